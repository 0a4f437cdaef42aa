//! Memory usage of a linked image, and its files for flash programmers.

use object::LittleEndian;
use object::elf::{PT_LOAD, SHF_ALLOC};
use object::read::elf::{ElfFile32, ProgramHeader as _, SectionHeader as _};
use std::fmt;
use std::ops::Range;

/// Data bytes per record of a .hex file.
const RECORD: usize = 16;
/// Largest gap within a block \[bytes\]. Alignment of sections leaves such gaps; larger gaps belong to something else,
/// such as the parameters.
const GAP_MAX: u64 = 256;
/// Value of erased flash bytes.
const ERASED: u8 = 0xFF;

/// Contiguous bytes of flash.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Block {
    pub(crate) address: u32,
    pub(crate) bytes: Vec<u8>,
}

impl Block {
    fn end(&self) -> u64 {
        u64::from(self.address) + self.bytes.len() as u64
    }
}

/// Contents of a linked image.
#[derive(Debug)]
pub(crate) struct Contents {
    /// Blocks of flash, sorted by address.
    pub(crate) blocks: Vec<Block>,
    /// Address of the program's entry point.
    entry: u32,
    /// Run-time addresses of all sections.
    sections: Vec<Range<u64>>,
}

impl Contents {
    /// Reads an ELF file.
    pub(crate) fn read(elf: &[u8]) -> Result<Self, object::Error> {
        let file = ElfFile32::<LittleEndian>::parse(elf)?;
        let (endian, mut blocks) = (LittleEndian, Vec::new());
        for header in file.elf_program_headers() {
            let bytes = header.data(endian, elf).unwrap_or_default();
            if header.p_type(endian) == PT_LOAD && !bytes.is_empty() {
                // The physical address is where the bytes are stored. Initial values of variables are used at another
                // address.
                blocks.push(Block { address: header.p_paddr(endian), bytes: bytes.to_vec() });
            }
        }
        blocks.sort_by_key(|block| block.address);
        let sections = file.elf_section_table().iter();
        let sections = sections.filter(|section| section.sh_flags(endian) & SHF_ALLOC != 0).map(|section| {
            let start = u64::from(section.sh_addr(endian));
            start..start + u64::from(section.sh_size(endian))
        });
        Ok(Contents {
            sections: sections.collect(),
            blocks: joined(blocks),
            entry: file.elf_header().e_entry.get(endian),
        })
    }

    /// Returns the image as an Intel HEX file.
    pub(crate) fn hex(&self) -> Result<String, ihex::WriterError> {
        use ihex::Record;
        let (mut records, mut upper) = (Vec::new(), None);
        for block in &self.blocks {
            let (mut address, mut bytes) = (block.address, block.bytes.as_slice());
            while !bytes.is_empty() {
                // A record must end where the upper half of the address changes.
                let room = 0x1_0000 - (address as usize & 0xFFFF);
                let (value, rest) = bytes.split_at(bytes.len().min(RECORD).min(room));
                let half = (address >> 16) as u16;
                if upper.replace(half) != Some(half) {
                    records.push(Record::ExtendedLinearAddress(half));
                }
                records.push(Record::Data { offset: address as u16, value: value.to_vec() });
                address = address.wrapping_add(value.len() as u32);
                bytes = rest;
            }
        }
        records.extend([Record::StartLinearAddress(self.entry), Record::EndOfFile]);
        ihex::create_object_file_representation(&records)
    }

    /// Returns the usage of each region. The flash counts as used up to its last byte, the stack as used entirely.
    pub(crate) fn usage(&self, regions: &[Region]) -> Vec<Usage> {
        let used = |region: &Region| match region.name.as_str() {
            "STACK" => region.length,
            "FLASH" => {
                let ends = self.blocks.iter().map(Block::end).filter(|end| *end <= region.end());
                ends.max().map_or(0, |end| end.saturating_sub(region.origin))
            }
            _ => {
                let sections = self.sections.iter().filter(|section| region.contains(section.start));
                sections.map(|section| section.end - section.start).sum()
            }
        };
        regions.iter().map(|region| Usage { region: region.clone(), used: used(region) }).collect()
    }
}

/// Joins blocks across small gaps, which are filled with erased bytes.
fn joined(blocks: Vec<Block>) -> Vec<Block> {
    let mut all: Vec<Block> = Vec::new();
    for block in blocks {
        match all.last_mut() {
            Some(last) if (last.end()..=last.end() + GAP_MAX).contains(&u64::from(block.address)) => {
                let gap = u64::from(block.address) - last.end();
                last.bytes.resize(last.bytes.len() + gap as usize, ERASED);
                last.bytes.extend(block.bytes);
            }
            _ => all.push(block),
        }
    }
    all
}

/// A region of a memory map.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Region {
    pub(crate) name: String,
    pub(crate) origin: u64,
    /// Size \[bytes\].
    pub(crate) length: u64,
}

impl Region {
    /// Reads the regions of a linker script, one per line: `RAM : ORIGIN = 0x20010000, LENGTH = 64K`.
    pub(crate) fn of_script(script: &str) -> Vec<Self> {
        let region = |line: &str| {
            let (name, rest) = line.split_once(':')?;
            let (origin, length) = rest.trim().strip_prefix("ORIGIN = 0x")?.split_once(", LENGTH = ")?;
            let origin = u64::from_str_radix(origin, 16).ok()?;
            let length = 1024 * length.trim().strip_suffix('K')?.parse::<u64>().ok()?;
            Some(Region { name: name.trim().to_owned(), origin, length })
        };
        script.lines().filter_map(region).collect()
    }

    fn end(&self) -> u64 {
        self.origin + self.length
    }

    fn contains(&self, address: u64) -> bool {
        (self.origin..self.end()).contains(&address)
    }
}

/// Usage of a region by an image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Usage {
    pub(crate) region: Region,
    /// Used bytes.
    pub(crate) used: u64,
}

impl fmt::Display for Usage {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        let Usage { region: Region { name, origin, length }, used } = self;
        write!(formatter, "{name:6} {origin:#010x} {used:7} of {length:7} bytes used, {}", room(&[self]))
    }
}

/// Returns the free share of several regions together.
pub(crate) fn room(of: &[&Usage]) -> Room {
    let length: u64 = of.iter().map(|usage| usage.region.length).sum();
    let used: u64 = of.iter().map(|usage| usage.used).sum();
    Room { percent: 100 * length.saturating_sub(used) / length.max(1) }
}

/// Free share of memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Room {
    /// Free share in percent, rounded down.
    pub(crate) percent: u64,
}

impl fmt::Display for Room {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        write!(formatter, "{} % free", self.percent)
    }
}

#[cfg(test)]
#[allow(clippy::expect_used, clippy::panic, reason = "a test that cannot go on should say why")]
mod tests {
    use super::*;
    use proptest::collection::vec;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    /// Writes an ELF file that has only segments: header, program headers, contents (ELF specification).
    fn elf(entry: u32, segments: &[(u32, Vec<u8>)]) -> Vec<u8> {
        let [half, word] =
            [|value: u16| value.to_le_bytes().to_vec(), |value: u16| u32::from(value).to_le_bytes().to_vec()];
        let count = segments.len() as u16;
        let mut file = b"\x7fELF\x01\x01\x01\0\0\0\0\0\0\0\0\0".to_vec();
        // The header states an executable file for an Arm processor.
        [half(2), half(40), word(1)].into_iter().for_each(|field| file.extend(field));
        file.extend(entry.to_le_bytes());
        [word(52), word(0), word(0), half(52), half(32), half(count), half(40), half(0), half(0)]
            .into_iter()
            .for_each(|field| file.extend(field));
        let mut offset = 52 + 32 * segments.len() as u32;
        for (address, bytes) in segments {
            let length = bytes.len() as u32;
            // PT_LOAD segments are used in RAM and stored at `address`.
            for field in [1, offset, 0x2000_0000, *address, length, length + 4, 7, 1_u32] {
                file.extend(field.to_le_bytes());
            }
            offset += length;
        }
        segments.iter().for_each(|(_, bytes)| file.extend(bytes));
        file
    }

    /// Reads the bytes of a .hex file by address, following the format's specification.
    fn bytes_of(hex: &str) -> BTreeMap<u32, u8> {
        let (mut bytes, mut upper) = (BTreeMap::new(), 0);
        for line in hex.lines() {
            let record: Vec<u8> = (1..line.len())
                .step_by(2)
                .map(|at| u8::from_str_radix(line.get(at..at + 2).expect("pairs"), 16).expect("digits"))
                .collect();
            assert!(line.starts_with(':') && record.iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte)) == 0);
            let [length, high, low, kind, data @ .., _] = record.as_slice() else { panic!("{line}") };
            assert_eq!(usize::from(*length), data.len());
            match (kind, data) {
                (0, _) => {
                    let offset = u32::from(u16::from_be_bytes([*high, *low]));
                    for (at, byte) in (upper | offset..).zip(data) {
                        assert_eq!(bytes.insert(at, *byte), None, "twice at {at:#x}");
                    }
                }
                (4, [a, b]) => upper = u32::from_be_bytes([*a, *b, 0, 0]),
                (5, _) => assert_eq!(data, 0x0800_C001_u32.to_be_bytes()),
                (1, []) => (),
                _ => panic!("{line}"),
            }
        }
        assert!(hex.trim_end().ends_with(":00000001FF"));
        bytes
    }

    proptest! {
        /// The .hex file holds the segments' bytes at their storage addresses, and nothing else except the filling of
        /// small gaps.
        #[test]
        fn hex_has_what_the_segments_have(parts in vec((0_u32..0x3_0000, vec(any::<u8>(), 1..700)), 1..6)) {
            let (mut next, mut segments) = (0x0800_0000, Vec::new());
            for (gap, bytes) in parts {
                let address = next + gap;
                next = address + bytes.len() as u32;
                segments.push((address, bytes));
            }
            let contents = Contents::read(&elf(0x0800_C001, &segments)).expect("valid");
            let mut expected = BTreeMap::new();
            let mut end = None;
            for (address, bytes) in &segments {
                if let Some(end) = end.filter(|end| address - end <= GAP_MAX as u32) {
                    expected.extend((end..*address).map(|at| (at, ERASED)));
                }
                expected.extend((*address..).zip(bytes.iter().copied()));
                end = Some(address + bytes.len() as u32);
            }
            prop_assert_eq!(&bytes_of(&contents.hex().expect("written")), &expected);
            let blocks = contents.blocks.iter().flat_map(|block| (block.address..).zip(block.bytes.iter().copied()));
            prop_assert_eq!(blocks.collect::<BTreeMap<_, _>>(), expected);
        }
    }

    /// Sizes by the data sheets: the STM32F405RG has 1 MiB of flash and 192 KiB of RAM; of the STM32H743VI, the first
    /// flash bank is used.
    #[test]
    fn regions_are_the_chips() {
        let f405 = Region::of_script(include_str!("../../../memory.x"));
        let total = |regions: &[Region], is_flash| {
            regions
                .iter()
                .filter(|region| (region.name == "FLASH") == is_flash)
                .map(|region| region.length)
                .sum::<u64>()
        };
        assert_eq!([true, false].map(|is_flash| total(&f405, is_flash)), [1 << 20, 192 << 10]);
        let h743 = Region::of_script(include_str!("../../boards/stm32h743/memory.x"));
        assert_eq!([true, false].map(|is_flash| total(&h743, is_flash)), [1 << 20, (128 + 512) << 10]);
    }

    #[test]
    fn room_is_what_is_left() {
        let contents = Contents {
            blocks: vec![
                Block { address: 0x0800_0000, bytes: vec![0; 8] },
                Block { address: 0x0800_2000, bytes: vec![0; 1024] },
            ],
            entry: 0,
            sections: vec![0x2000_1000..0x2000_1400, 0x2000_1400..0x2000_1800, 0x0800_2000..0x0800_2400],
        };
        let script = "FLASH : ORIGIN = 0x08000000, LENGTH = 12K\nSTACK : ORIGIN = 0x20000000, LENGTH = 4K\n\
                      RAM : ORIGIN = 0x20001000, LENGTH = 4K\nCCMRAM : ORIGIN = 0x10000000, LENGTH = 4K";
        let usage = contents.usage(&Region::of_script(script));
        assert_eq!(usage.iter().map(|usage| usage.used).collect::<Vec<_>>(), [9 << 10, 4 << 10, 2 << 10, 0]);
        let [flash, stack, ram, coupled] = usage.as_slice() else { panic!("{usage:?}") };
        assert_eq!(room(&[flash]).percent, 25);
        assert_eq!(room(&[stack, ram, coupled]).percent, 50);
    }
}

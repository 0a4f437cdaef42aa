//! Parts of the store: names, owner numbers, layout of records in flash, and the flash in RAM.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs)] // tests

use afbc_store::{Error, NAME_MAX, Ram, RecordName, Store, StoreCondition, hash};
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use proptest::prelude::*;

const SECTOR: usize = 480;
const RECORD: usize = 28;

/// Computes CRC-32 (ISO-HDLC) bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0_u32, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 })
    })
}

/// Returns a record: name, value, edition, kind, checksum.
fn record(name: &str, bits: u32, edition: u16, kind: [u8; 2]) -> Vec<u8> {
    let mut bytes = name.as_bytes().to_vec();
    bytes.resize(NAME_MAX, 0);
    bytes.extend([bits.to_le_bytes().as_slice(), &edition.to_le_bytes(), &kind].concat());
    bytes.extend(crc32(&bytes).to_le_bytes());
    bytes
}

/// Flash of four sectors.
#[derive(Clone, Debug, PartialEq)]
struct Large(Vec<u8>);

impl ErrorType for Large {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Large {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        bytes.copy_from_slice(&self.0[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        4 * SECTOR
    }
}

impl NorFlash for Large {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        self.0[from as usize..to as usize].fill(0xFF);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        self.0[offset as usize..][..bytes.len()].copy_from_slice(bytes);
        Ok(())
    }
}

fn name() -> impl Strategy<Value = String> {
    "[!-~]{1,16}"
}

proptest! {
    /// A name keeps its text at any format width, and survives a reset if it begins with an underscore.
    #[test]
    fn a_name_is_its_text(text in name(), width in 0..20_usize) {
        let name = RecordName::new(&text).unwrap();
        prop_assert_eq!(name.as_str(), &text);
        prop_assert_eq!([name.to_string(), format!("{name:?}")], [text.clone(), format!("{text:?}")]);
        prop_assert_eq!(format!("{name:>width$}"), format!("{text:>width$}"));
        let zeros = vec![0; NAME_MAX - text.len()];
        prop_assert_eq!(name.to_bytes().to_vec(), [text.as_bytes(), &zeros].concat());
        prop_assert_eq!(name.outlasts(), text.starts_with('_'));
        prop_assert_eq!(RecordName::of(text.chars()), Some(name));
    }

    #[test]
    fn an_owner_is_told_by_its_checksum(bytes in prop::collection::vec(any::<u8>(), 0..40)) {
        prop_assert_eq!(hash(&bytes), crc32(&bytes));
    }

    /// Records have the documented layout: the store reads records of another program, and that program would read the
    /// store's.
    #[test]
    fn records_lie_in_flash_as_described(
        values in prop::collection::btree_map(name(), (any::<u32>(), any::<u16>()), 1..10),
        owner: u32,
        sequence in 1..1_000_u32,
        taken_back in any::<prop::sample::Index>(),
    ) {
        let taken_back = values.keys().nth(taken_back.index(values.len())).unwrap();
        let mut written = vec![record("", sequence, 0, *b"1H"), record("", owner, 0, *b"2B")];
        written.extend(values.iter().map(|(name, (bits, edition))| record(name, *bits, *edition, *b"3V")));
        written.push(record(taken_back, 0, 7, *b"4N"));
        let mut bytes = written.concat();
        bytes.resize(2 * SECTOR, 0xFF);
        let mut flash = Large([vec![0xA5; SECTOR], bytes, vec![0x5A; SECTOR]].concat());
        let mut store = Store::open(flash.clone(), SECTOR as u32, owner).unwrap();
        prop_assert_eq!(store.found(), StoreCondition::default());
        for (name, (bits, edition)) in &values {
            let wanted = (name != taken_back).then_some((*edition, *bits));
            prop_assert_eq!(store.get(RecordName::new(name).unwrap()), Ok(wanted));
        }
        store.set(RecordName::new(taken_back).unwrap(), 9, Some(5)).unwrap();
        let at = SECTOR + RECORD * written.len();
        flash.0[at..at + RECORD].copy_from_slice(&record(taken_back, 5, 9, *b"3V"));
        prop_assert!(store.into_flash() == flash);
    }

    /// Flash beside the store's two sectors stays unchanged.
    #[test]
    fn neighbours_are_left_alone(sets in prop::collection::vec((0..6_u8, any::<u32>()), 1..80)) {
        let flash = Large([vec![0xA5; SECTOR], vec![0; 2 * SECTOR], vec![0x5A; SECTOR]].concat());
        let mut store = Store::open(flash, SECTOR as u32, 1).unwrap();
        prop_assert!(store.found().foreign);
        store.make_room().unwrap();
        let mut held = [None; 6];
        for (number, bits) in sets {
            let name = RecordName::new(&format!("P{number}")).unwrap();
            if store.set(name, 0, Some(bits)) == Err(Error::NeedsErase) {
                store.make_room().unwrap();
                store.set(name, 0, Some(bits)).unwrap();
            }
            held[usize::from(number)] = Some((0, bits));
        }
        let flash = store.into_flash();
        prop_assert!(flash.0[..SECTOR].iter().all(|byte| *byte == 0xA5));
        prop_assert!(flash.0[3 * SECTOR..].iter().all(|byte| *byte == 0x5A));
        let mut store = Store::open(flash, SECTOR as u32, 1).unwrap();
        for (number, held) in held.into_iter().enumerate() {
            prop_assert_eq!(store.get(RecordName::new(&format!("P{number}")).unwrap()), Ok(held));
        }
    }

    /// Each damaged place is counted, loses only its own value, and is dropped when room is made.
    #[test]
    fn damaged_places_are_counted(count in 1..12_u32, damaged in prop::collection::btree_set(0..12_u32, 0..6)) {
        let damaged: Vec<_> = damaged.into_iter().filter(|number| *number < count).collect();
        let name = |number: u32| RecordName::new(&format!("P{number}")).unwrap();
        let blank = Large(vec![0xFF; 4 * SECTOR]);
        let mut store = Store::open(blank, 0, 1).unwrap();
        store.make_room().unwrap();
        (0..count).for_each(|number| store.set(name(number), 0, Some(number)).unwrap());
        let mut flash = store.into_flash();
        // The records of the values come after the header and the begin record.
        damaged.iter().for_each(|number| flash.0[RECORD * (2 + *number as usize) + 20] ^= 0x10);
        let mut store = Store::open(flash, 0, 1).unwrap();
        prop_assert_eq!(store.found().damaged, damaged.len() as u32);
        let is_held = |store: &mut Store<Large>| {
            let wanted = |number| (!damaged.contains(&number)).then_some((0, number));
            (0..count).all(|number| store.get(name(number)) == Ok(wanted(number)))
        };
        prop_assert!(is_held(&mut store));
        store.make_room().unwrap();
        let mut store = Store::open(store.into_flash(), 0, 1).unwrap();
        prop_assert!(is_held(&mut store) && store.found() == StoreCondition::default());
    }

    /// The flash in RAM clears bits on a write, sets them on an erase, and refuses addresses outside of it and
    /// incomplete words.
    #[test]
    fn ram_is_flash(writes in prop::collection::vec((0..250_u32, 0..40_usize, any::<u8>(), any::<bool>()), 1..20)) {
        let (mut ram, mut model) = (Ram::<96>::BLANK, vec![0xFF; 192]);
        prop_assert_eq!(ram.capacity(), 192);
        for (offset, length, byte, erases) in writes {
            let (from, to) = (offset as usize, offset as usize + length);
            if erases {
                let (from, to) = (offset / 50 * 96, (offset / 50 + length as u32 / 20) * 96);
                prop_assert_eq!(ram.erase(from, to).is_ok(), to <= 192);
                prop_assert!(ram.erase(from + 1, to + 97).is_err());
                if to <= 192 {
                    model[from as usize..to as usize].fill(0xFF);
                }
            } else {
                let fits = to <= 192 && from.is_multiple_of(4) && length.is_multiple_of(4);
                prop_assert_eq!(ram.write(offset, &vec![byte; length]).is_ok(), fits);
                if fits {
                    model[from..to].iter_mut().for_each(|held| *held &= byte);
                }
            }
            let mut read = vec![0; length];
            prop_assert_eq!(ram.read(offset, &mut read).is_ok(), to <= 192);
            if to <= 192 {
                prop_assert_eq!(&read, &model[from..to]);
            }
        }
    }
}

/// The texts for a ground station have the right length, and `Display` adds the flash's own error.
#[test]
fn errors_say_what_to_do() {
    let errors = [Error::Flash("busy"), Error::NeedsErase, Error::Full];
    let reasons = errors.map(|error| error.reason());
    assert!(
        reasons.iter().all(|reason| reason.starts_with("parameter not kept: ") && reason.len() <= 50),
        "{reasons:?}"
    );
    assert!(reasons[0] != reasons[1] && reasons[1] != reasons[2] && reasons[0] != reasons[2]);
    let told = errors.map(|error| error.to_string());
    assert_eq!(told, [format!("{} (\"busy\")", reasons[0]), reasons[1].into(), reasons[2].into()]);
}

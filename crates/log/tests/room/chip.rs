//! Simulates a serial NOR flash chip: its commands and times by the data sheet (Winbond's W25Q128JV, revision F).

use super::Storage;
use afbc_log::storage::{FlashKeeper, NorChip};
use embedded_hal::spi::{ErrorKind, ErrorType, Operation, SpiDevice};
use std::cell::Cell;
use std::sync::{Arc, Mutex};

pub(crate) const SECTOR: usize = 65_536;
const PAGE: usize = 256;

thread_local! {
    /// Simulated time \[us\].
    static CLOCK_US: Cell<u64> = const { Cell::new(0) };
}

fn now_us() -> u64 {
    CLOCK_US.get()
}

/// A change of the chip's cells.
#[derive(Clone, Debug)]
pub(crate) enum Change {
    Program(usize, Vec<u8>),
    Erase(usize),
}

#[derive(Debug)]
pub(crate) struct Cells {
    pub(crate) bytes: Vec<u8>,
    /// Each change with its time \[us\].
    pub(crate) changes: Vec<(u64, Change)>,
    pub(crate) is_there: bool,
    /// Number of calls until one fails; none if no call fails.
    pub(crate) fails_in: Option<u32>,
    /// True if the chip accepts commands but changes nothing.
    pub(crate) is_protected: bool,
    /// Time to program a page and to erase a sector \[us\].
    pub(crate) takes_us: [u64; 2],
    busy_until_us: u64,
    is_enabled: bool,
    began_us: u64,
}

#[derive(Clone, Debug)]
pub(crate) struct Chip(pub(crate) Arc<Mutex<Cells>>);

impl Chip {
    /// Creates a blank chip.
    pub(crate) fn new(sectors: usize) -> Self {
        Chip::holding(vec![0xFF; sectors * SECTOR])
    }

    pub(crate) fn holding(bytes: Vec<u8>) -> Self {
        Chip(Arc::new(Mutex::new(Cells {
            bytes,
            changes: Vec::new(),
            is_there: true,
            fails_in: None,
            is_protected: false,
            takes_us: [700, 150_000],
            busy_until_us: 0,
            is_enabled: false,
            began_us: 0,
        })))
    }
}

impl Cells {
    fn is_busy(&self) -> bool {
        now_us() < self.busy_until_us
    }

    /// Executes a command with its data. Returns the chip's answer.
    fn command(&mut self, command: &[u8], answer: usize) -> Vec<u8> {
        let address = || command[1..4].iter().fold(0, |address, byte| address << 8 | usize::from(*byte));
        let is_busy = self.is_busy();
        let mut answers = match command[0] {
            0x05 => vec![u8::from(is_busy) | u8::from(self.is_enabled) << 1],
            0xAB => Vec::new(),
            // A busy chip accepts only the commands above.
            _ if is_busy => panic!("{command:?} while it is busy"),
            0x9F => vec![0xEF, 0x40, self.bytes.len().ilog2() as u8],
            0x03 => self.bytes[address()..address() + answer].to_vec(),
            0x06 => {
                self.is_enabled = true;
                Vec::new()
            }
            0x02 => {
                let (at, bytes) = (address(), &command[4..]);
                assert!(!bytes.is_empty() && at % PAGE + bytes.len() <= PAGE, "{} bytes at {at:#x}", bytes.len());
                self.change(Change::Program(at, bytes.to_vec()));
                Vec::new()
            }
            0xD8 => {
                assert!(address().is_multiple_of(SECTOR));
                self.change(Change::Erase(address() / SECTOR));
                Vec::new()
            }
            other => panic!("command {other:#x}"),
        };
        answers.resize(answer, 0xFF);
        answers
    }

    fn change(&mut self, change: Change) {
        assert!(std::mem::take(&mut self.is_enabled), "it is not enabled");
        self.busy_until_us = now_us() + self.takes_us[usize::from(matches!(change, Change::Erase(_)))];
        if !self.is_protected {
            apply(&mut self.bytes, &change);
            self.changes.push((now_us(), change));
        }
    }
}

/// Changes cells. Panics if a bit would have to change from 0 to 1 without an erasure.
pub(crate) fn apply(cells: &mut [u8], change: &Change) {
    match change {
        Change::Program(at, bytes) => cells[*at..*at + bytes.len()].iter_mut().zip(bytes).for_each(|(cell, byte)| {
            assert_eq!(*cell & byte, *byte, "it is programmed already");
            *cell &= byte;
        }),
        Change::Erase(sector) => cells[sector * SECTOR..][..SECTOR].fill(0xFF),
    }
}

/// The chip's SPI bus.
#[derive(Debug)]
pub(crate) struct Wire(Chip);

#[derive(Debug)]
pub(crate) struct Broken;

impl embedded_hal::spi::Error for Broken {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

impl ErrorType for Wire {
    type Error = Broken;
}

impl SpiDevice for Wire {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Broken> {
        let mut cells = self.0.0.lock().unwrap();
        let (mut command, mut answer) = (Vec::new(), 0);
        for operation in operations.iter() {
            match operation {
                Operation::Write(bytes) => command.extend_from_slice(bytes),
                Operation::Read(into) => answer += into.len(),
                _ => panic!("it neither reads nor writes"),
            }
        }
        // Reading the status takes longer than on a real bus, so that a wait needs few reads.
        let takes_us = if command[0] == 0x05 { 50 } else { 5 + (command.len() + answer) as u64 / 2 };
        CLOCK_US.set(now_us() + takes_us);
        if let Some(left) = &mut cells.fails_in {
            if *left == 0 {
                cells.fails_in = None;
                return Err(Broken);
            }
            *left -= 1;
        }
        let is_there = cells.is_there;
        let answers = if is_there { cells.command(&command, answer) } else { vec![0; answer] };
        let mut rest = answers.as_slice();
        for operation in operations {
            if let Operation::Read(into) = operation {
                let (bytes, behind) = rest.split_at(into.len());
                into.copy_from_slice(bytes);
                rest = behind;
            }
        }
        Ok(())
    }
}

impl Storage for Chip {
    type Keeper = FlashKeeper<'static>;
    const SMALL: bool = true;

    fn keeper(&self) -> Self::Keeper {
        FlashKeeper::new(Box::leak(Box::new(NorChip::new(Wire(self.clone()), now_us))))
    }

    fn begin(&self, now_us: u64) {
        // A running operation of the chip continues up to this time.
        CLOCK_US.set(now_us);
        self.0.lock().unwrap().began_us = now_us;
    }

    fn taken_us(&self) -> u64 {
        now_us() - self.0.lock().unwrap().began_us
    }

    fn logs(&self) -> Vec<(String, Vec<u8>)> {
        logs(&self.0.lock().unwrap().bytes)
    }
}

/// Returns the logs in these cells, as docs/reference/black-box-storage.md describes them.
pub(crate) fn logs(cells: &[u8]) -> Vec<(String, Vec<u8>)> {
    let word = |sector: &[u8], at: usize| u32::from_le_bytes(sector[at..at + 4].try_into().unwrap());
    let pair = |sector: &[u8], at: usize, other: usize| {
        let [value, inverse] = [word(sector, at), word(sector, other)];
        (value == !inverse).then_some(value)
    };
    let mut logs: Vec<(u32, Vec<&[u8]>)> = Vec::new();
    for sector in cells.chunks(SECTOR).filter(|sector| sector.starts_with(b"AFBCLOG1")) {
        let (Some(log), Some(part)) = (pair(sector, 8, 16), pair(sector, 12, 20)) else { continue };
        match logs.last_mut() {
            Some((number, parts)) if *number == log && parts.len() as u32 == part => parts.push(sector),
            _ if part == 0 => logs.push((log, vec![sector])),
            _ => (),
        }
    }
    let whole = |(log, sectors): (u32, Vec<&[u8]>)| {
        let (last, full) = sectors.split_last().unwrap();
        let written = last[PAGE..].chunks(PAGE).rposition(|page| page.iter().any(|byte| *byte != 0xFF));
        // The last page of an unfinished log may be incomplete.
        let length = pair(last, 24, 28).map_or(written.unwrap_or(0) * PAGE, |length| length as usize);
        let rooms = full.iter().map(|sector| &sector[PAGE..]).chain([&last[PAGE..PAGE + length]]);
        (format!("{log}"), rooms.flatten().copied().collect())
    };
    logs.into_iter().map(whole).collect()
}

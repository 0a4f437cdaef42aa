//! Serial NOR flash chip of 16 MiB: Winbond's W25Q128JV (revision F: commands in section 8, times in 9.6).

use super::{CardFaults, LogStorage};
use rigless::chip::Timeline;
use rigless::chip::spi::Peer;
use rigless::snapshot::{Error, Reader, Store, Writer};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::error::Error as AnyError;

const SECTOR: usize = 65_536;
const SECTORS: usize = 256;
const PAGE: usize = 256;
const BLANK: u8 = 0xFF;
/// Byte read from an idle line.
const REST: u32 = 0xFF;
const PROGRAM_NS: u64 = 700_000;
const ERASE_NS: u64 = 150_000_000;
/// Manufacturer Winbond, 3 V serial flash, 2^24 bytes.
const ID: [u8; 3] = [0xEF, 0x40, 0x18];
/// Bytes of a command with its address of three bytes.
const ADDRESSED: usize = 4;

/// Flash chip on SPI.
#[derive(Debug)]
pub struct FlashChip {
    /// Sectors that are not blank.
    sectors: BTreeMap<usize, Vec<u8>>,
    /// Bytes received since the chip was selected.
    heard: Vec<u8>,
    now: FlashState,
}

#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct FlashState {
    faults: CardFaults,
    busy_until_ns: u64,
    is_enabled: bool,
    written: u64,
}

impl FlashChip {
    pub fn new() -> Self {
        FlashChip { sectors: BTreeMap::new(), heard: Vec::new(), now: FlashState::default() }
    }

    fn address(&self) -> usize {
        self.heard[1..ADDRESSED].iter().fold(0, |address, byte| address << 8 | usize::from(*byte))
    }

    fn byte(&self, address: usize) -> u8 {
        self.sectors.get(&(address / SECTOR % SECTORS)).map_or(BLANK, |sector| sector[address % SECTOR])
    }

    /// Executes the received command when the chip is deselected.
    fn execute(&mut self, now_ns: u64) {
        let takes_ns = match self.heard.first() {
            Some(0x06) => {
                self.now.is_enabled = true;
                return;
            }
            Some(0x02) if self.heard.len() > ADDRESSED && self.now.is_enabled => {
                let at = self.address();
                let sector = self.sectors.entry(at / SECTOR % SECTORS).or_insert_with(|| vec![BLANK; SECTOR]);
                let page = at % SECTOR / PAGE * PAGE;
                // A write beyond the end of a page wraps to its beginning.
                for (index, byte) in self.heard[ADDRESSED..].iter().enumerate() {
                    sector[page + (at + index) % PAGE] &= byte;
                }
                self.now.written += 1;
                PROGRAM_NS
            }
            Some(0xD8) if self.heard.len() == ADDRESSED && self.now.is_enabled => {
                self.sectors.remove(&(self.address() / SECTOR % SECTORS));
                ERASE_NS
            }
            _ => return,
        };
        self.now.is_enabled = false;
        self.now.busy_until_ns = now_ns + takes_ns;
        if let Some([at_ms, ms]) = self.now.faults.stall_ms.filter(|[at_ms, _]| now_ns >= at_ms * 1_000_000) {
            self.now.busy_until_ns += ms * 1_000_000;
            self.now.faults.stall_ms = None;
            println!("{:8.3} s  the chip stalls for {ms} ms, from {at_ms} ms on", now_ns as f64 * 1e-9);
        }
    }
}

impl Peer for FlashChip {
    fn transfer(&mut self, mosi: u32, _: u8, context: &mut Timeline<'_, '_>) -> u32 {
        let now_ns = context.now().0;
        let is_out = self.now.faults.out_ms.is_some_and(|[from, to]| (from..to).contains(&(now_ns / 1_000_000)));
        let place = self.heard.len();
        let command = *self.heard.first().unwrap_or(&(mosi as u8));
        let is_busy = now_ns < self.now.busy_until_ns;
        if is_out || is_busy && command != 0x05 {
            return REST;
        }
        // Bytes sent during a read have no meaning; only their number counts.
        if place < ADDRESSED || command == 0x02 || command == 0xD8 {
            self.heard.push(mosi as u8);
        } else {
            self.heard.push(0);
        }
        match command {
            0x05 if place > 0 => u32::from(is_busy) | u32::from(self.now.is_enabled) << 1,
            0x9F if place > 0 => ID.get(place - 1).map_or(REST, |byte| u32::from(*byte)),
            0x03 if place >= ADDRESSED => self.byte(self.address() + place - ADDRESSED).into(),
            _ => REST,
        }
    }

    fn select(&mut self, _: &mut Timeline<'_, '_>) {
        self.heard.clear();
    }

    fn deselect(&mut self, context: &mut Timeline<'_, '_>) {
        self.execute(context.now().0);
        self.heard.clear();
    }
}

impl LogStorage for FlashChip {
    fn set_faults(&mut self, faults: CardFaults) {
        self.now.faults = faults;
    }

    /// Fills the first sectors with data other than logs, up to `room` free bytes.
    fn fill(&mut self, room: u64) {
        let free = room.div_ceil(SECTOR as u64) as usize;
        self.sectors = (0..SECTORS.saturating_sub(free)).map(|sector| (sector, vec![0xA5; SECTOR])).collect();
    }

    /// Follows the layout in docs/reference/black-box-storage.md: a sector begins with a page that names the log and
    /// the sector's part of it.
    fn logs(&self) -> Result<Vec<(String, Vec<u8>)>, Box<dyn AnyError>> {
        let word = |sector: &[u8], at: usize| u32::from_le_bytes([0, 1, 2, 3].map(|byte| sector[at + byte]));
        let pair = |sector: &[u8], at: usize, other: usize| {
            Some(word(sector, at)).filter(|value| *value == !word(sector, other))
        };
        let mut logs: BTreeMap<u32, Vec<&[u8]>> = BTreeMap::new();
        for sector in self.sectors.values().filter(|sector| sector.starts_with(b"AFBCLOG1")) {
            if let (Some(log), Some(_)) = (pair(sector, 8, 16), pair(sector, 12, 20)) {
                logs.entry(log).or_default().push(sector);
            }
        }
        let whole = |(log, sectors): (u32, Vec<&[u8]>)| {
            let (last, full) = sectors.split_last()?;
            let written = last[PAGE..].chunks(PAGE).rposition(|page| page.iter().any(|byte| *byte != BLANK));
            // A log without an end may have a torn last page, which is left out.
            let length = pair(last, 24, 28).map_or(written.unwrap_or(0) * PAGE, |length| length as usize);
            let rooms = full.iter().map(|sector| &sector[PAGE..]).chain([last.get(PAGE..PAGE + length)?]);
            Some((format!("log{log:03}.ulg"), rooms.flatten().copied().collect()))
        };
        Ok(logs.into_iter().filter_map(whole).collect())
    }

    fn written(&self) -> u64 {
        self.now.written
    }
}

impl Store for FlashChip {
    fn store(&self, to: &mut Writer) -> Result<(), Error> {
        to.put(&(self.now, &self.heard, &self.sectors))
    }

    fn load(&mut self, from: &mut Reader) -> Result<(), Error> {
        (self.now, self.heard, self.sectors) = from.take()?;
        Ok(())
    }
}

//! Keeps logs in flash one after another, from the first sector on. They stay until all logs are erased.

use crate::storage::block::LogBlock;
use crate::storage::flash::{FlashFailed, LogFlash, PROGRAM_BYTES, SECTOR_BYTES};
use crate::storage::keeper::{LogKeeper, StorageState};
use crate::storage::query::{KeeperAnswer, LogPage, LogQuery};
use crate::storage::sector::{HEAD_BYTES, Head, LENGTH_AT, ROOM, START, length_bytes, read_length};

/// Time between two attempts to start the flash \[us\].
const RETRY_US: u64 = 1_000_000;
/// Bytes of the sector ahead checked for blankness: with each block of a log (twice its size), and in each poll between
/// logs.
const LOOK_BYTES: u32 = 1_024;
const IDLE_LOOK_BYTES: u32 = 4_096;

/// The sector in which the next log begins, or the present one continues.
#[derive(Clone, Copy, Debug, Default)]
struct Ahead {
    sector: u32,
    /// Bytes at the sector's beginning that are known to be blank.
    blank: u32,
}

/// Place at which a log is being written.
#[derive(Clone, Copy, Debug)]
struct Written {
    head: Head,
    sector: u32,
    /// Bytes of the log in this sector.
    length: u32,
}

/// A stored log: its number, its first sector and its length.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    log: u32,
    first: u32,
    bytes: u32,
}

/// Keeps logs in flash.
pub struct FlashKeeper<'a> {
    flash: &'a mut dyn LogFlash,
    sectors: u32,
    state: StorageState,
    ahead: Ahead,
    written: Option<Written>,
    /// Number of the next log.
    next: u32,
    /// Number of the first log that was missing or unfinished when the logs were counted last.
    bound: Option<u32>,
    /// Place in the list of logs and location of the log being read.
    open: Option<(u16, Stretch)>,
    /// During an erasure, the sector erased last; the erasure goes from the last sector to the first.
    erased: Option<u32>,
    /// Time of the last call, and the time of the next attempt to start the flash \[us\].
    now_us: u64,
    retry_us: u64,
}

impl<'a> FlashKeeper<'a> {
    /// Creates the keeper. The flash's state is unknown until [`poll`](LogKeeper::poll).
    pub fn new(flash: &'a mut dyn LogFlash) -> Self {
        FlashKeeper {
            flash,
            sectors: 0,
            state: StorageState::Unknown,
            ahead: Ahead::default(),
            written: None,
            next: 1,
            bound: None,
            open: None,
            erased: None,
            now_us: 0,
            retry_us: 0,
        }
    }

    /// Returns true if the flash has started and not failed since.
    fn works(&self) -> bool {
        matches!(self.state, StorageState::Ready | StorageState::Full)
    }

    /// Makes a call that needs the flash. If the call fails, gives up the log.
    fn attempt(&mut self, call: &mut dyn FnMut(&mut Self) -> Result<(), FlashFailed>) {
        if call(self).is_err() {
            self.state = StorageState::Failed;
            (self.written, self.open, self.erased) = (None, None, None);
            // The next attempt waits, so that the writer sees the failure and begins a new log.
            self.retry_us = self.now_us.saturating_add(RETRY_US);
        }
    }

    /// Starts the flash, and reads the head of every sector.
    fn start(&mut self) -> Result<(), FlashFailed> {
        self.sectors = self.flash.start()?.min(u32::MAX / SECTOR_BYTES);
        self.ahead = Ahead::default();
        for sector in 0..self.sectors {
            let head = self.head_bytes(sector)?;
            // A sector that is not blank is in use: by other data, or by the remains of an interrupted write.
            // `look_ahead` moves on behind the last such sector.
            if head != [0xFF; HEAD_BYTES] {
                self.ahead.sector = sector;
            }
            if let Some(head) = Head::read(&head) {
                self.next = self.next.max(head.log.saturating_add(1));
            }
        }
        self.state = StorageState::Ready;
        self.look_ahead(IDLE_LOOK_BYTES)
    }

    fn head_bytes(&mut self, sector: u32) -> Result<[u8; HEAD_BYTES], FlashFailed> {
        let mut bytes = [0; HEAD_BYTES];
        self.flash.read(sector * SECTOR_BYTES, &mut bytes)?;
        Ok(bytes)
    }

    fn head(&mut self, sector: u32) -> Result<Option<Head>, FlashFailed> {
        Ok(Head::read(&self.head_bytes(sector)?))
    }

    /// Returns true if a page is blank.
    fn is_blank(&mut self, address: u32) -> Result<bool, FlashFailed> {
        let mut page = [0; PROGRAM_BYTES as usize];
        self.flash.read(address, &mut page)?;
        Ok(page.iter().all(|byte| *byte == 0xFF))
    }

    /// Checks this many more bytes of the sector ahead. Skips a sector that is not blank. The flash is full if no
    /// sector is left.
    fn look_ahead(&mut self, bytes: u32) -> Result<(), FlashFailed> {
        let until = self.ahead.blank.saturating_add(bytes).min(SECTOR_BYTES);
        while self.ahead.sector < self.sectors && self.ahead.blank < until {
            if !self.is_blank(self.ahead.sector * SECTOR_BYTES + self.ahead.blank)? {
                self.ahead = Ahead { sector: self.ahead.sector + 1, blank: 0 };
                break;
            }
            self.ahead.blank += PROGRAM_BYTES;
        }
        if self.ahead.sector >= self.sectors && self.written.is_none() {
            self.state = StorageState::Full;
        }
        Ok(())
    }

    /// Begins a part of a log in the next blank sector. If there is none, the flash is full and the log ends.
    fn begin(&mut self, head: Head) -> Result<(), FlashFailed> {
        while self.ahead.sector < self.sectors && self.ahead.blank < SECTOR_BYTES {
            self.look_ahead(SECTOR_BYTES)?;
        }
        if self.ahead.sector >= self.sectors {
            self.state = StorageState::Full;
            return self.finish();
        }
        let sector = self.ahead.sector;
        self.ahead = Ahead { sector: sector + 1, blank: 0 };
        self.flash.program(sector * SECTOR_BYTES, &head.bytes())?;
        // Reads the head back: a write-protected chip ignores the command.
        if self.head(sector)? != Some(head) {
            return Err(FlashFailed);
        }
        self.written = Some(Written { head, sector, length: 0 });
        Ok(())
    }

    fn append(&mut self, bytes: &[u8]) -> Result<(), FlashFailed> {
        let mut rest = bytes;
        while !rest.is_empty() {
            let Some(written) = self.written else { return Ok(()) };
            if written.length == ROOM {
                let Head { log, part } = written.head;
                self.begin(Head { log, part: part + 1 })?;
                continue;
            }
            let at = START + written.length;
            // `START` is a multiple of the page size, so the rest of the page is also within the sector.
            let count = (PROGRAM_BYTES - at % PROGRAM_BYTES) as usize;
            let (page, behind) = rest.split_at_checked(count).unwrap_or((rest, &[]));
            self.flash.program(written.sector * SECTOR_BYTES + at, page)?;
            self.written = Some(Written { length: written.length + page.len() as u32, ..written });
            rest = behind;
        }
        self.look_ahead(LOOK_BYTES)
    }

    /// Writes the log's length in its last sector into that sector's head. Does nothing if no log is being written.
    fn finish(&mut self) -> Result<(), FlashFailed> {
        let Some(Written { sector, length, .. }) = self.written.take() else { return Ok(()) };
        self.flash.program(sector * SECTOR_BYTES + LENGTH_AT, &length_bytes(length))
    }

    /// Ends the log.
    fn end(&mut self) {
        self.attempt(&mut |keeper| {
            keeper.finish()?;
            keeper.look_ahead(0)
        });
    }

    /// Returns the number of the log being written, or else of the next log.
    fn first_unfinished(&self) -> u32 {
        self.written.map_or(self.next, |written| written.head.log)
    }

    fn count(&mut self) -> Result<KeeperAnswer, FlashFailed> {
        let bound = self.first_unfinished();
        (self.bound, self.open) = (Some(bound), None);
        let mut count = 0;
        for sector in 0..self.ahead.sector {
            let head = self.head(sector)?;
            count += u32::from(head.is_some_and(|head| head.part == 0 && head.log < bound));
        }
        Ok(KeeperAnswer::Is(count))
    }

    /// Returns the log at a place in the counted list.
    fn find(&mut self, place: u16) -> Result<Option<Stretch>, FlashFailed> {
        if let Some((_, stretch)) = self.open.filter(|(open, _)| *open == place) {
            return Ok(Some(stretch));
        }
        // A station may ask for a log without asking for the count. Then the logs finished by now count.
        let now = self.first_unfinished();
        let bound = *self.bound.get_or_insert(now);
        let mut left = place;
        for first in 0..self.ahead.sector {
            let Some(head) = self.head(first)?.filter(|head| head.part == 0 && head.log < bound) else { continue };
            if left == 0 {
                let stretch = Stretch { log: head.log, first, bytes: self.measure(first, head.log)? };
                self.open = Some((place, stretch));
                return Ok(Some(stretch));
            }
            left -= 1;
        }
        Ok(None)
    }

    /// Returns the length of a log that begins in this sector \[bytes\].
    fn measure(&mut self, first: u32, log: u32) -> Result<u32, FlashFailed> {
        let (mut last, mut parts) = (first, 1);
        for sector in first + 1..self.ahead.sector {
            match self.head(sector)? {
                Some(head) if head == (Head { log, part: parts }) => (last, parts) = (sector, parts + 1),
                Some(_) => break,
                None => (),
            }
        }
        let mut length = [0; 8];
        self.flash.read(last * SECTOR_BYTES + LENGTH_AT, &mut length)?;
        let in_last = match read_length(&length) {
            Some(length) => length,
            // The power was cut before the log ended.
            None => self.unfinished(last)?,
        };
        Ok((parts - 1) * ROOM + in_last)
    }

    /// Returns the length of the written pages in a sector, without the last page. The last page's bits may have been
    /// changing when the power was cut.
    fn unfinished(&mut self, sector: u32) -> Result<u32, FlashFailed> {
        let mut length = ROOM;
        while length > 0 && self.is_blank(sector * SECTOR_BYTES + START + length - PROGRAM_BYTES)? {
            length -= PROGRAM_BYTES;
        }
        Ok(length.saturating_sub(PROGRAM_BYTES))
    }

    /// Returns the sector that contains a part of a log.
    fn sector_of(&mut self, log: u32, part: u32, first: u32) -> Result<Option<u32>, FlashFailed> {
        // The part lies further on if sectors were skipped.
        for sector in first.saturating_add(part)..self.ahead.sector {
            if self.head(sector)? == Some(Head { log, part }) {
                return Ok(Some(sector));
            }
        }
        Ok(None)
    }

    fn read(&mut self, place: u16, offset: u32, page: &mut [u8]) -> Result<KeeperAnswer, FlashFailed> {
        let Some(Stretch { log, first, bytes }) = self.find(place)? else { return Ok(KeeperAnswer::None) };
        let (mut at, mut rest, mut count) = (offset, page, 0);
        while at < bytes && !rest.is_empty() {
            // `measure` has seen this part. If it is missing now, the flash has failed; the log does not end here.
            let sector = self.sector_of(log, at / ROOM, first)?.ok_or(FlashFailed)?;
            let within = at % ROOM;
            let length = rest.len().min((ROOM - within).min(bytes - at) as usize);
            let Some((part, behind)) = rest.split_at_mut_checked(length) else { break };
            self.flash.read(sector * SECTOR_BYTES + START + within, part)?;
            (at, rest, count) = (at + length as u32, behind, count + length as u32);
        }
        Ok(KeeperAnswer::Is(count))
    }

    /// Erases the last sector that is not erased yet. So a power cut leaves whole logs, and at most the beginning of
    /// one more.
    fn erase_one(&mut self) -> Result<KeeperAnswer, FlashFailed> {
        // An erasure would delay the blocks of a log too long.
        if self.written.is_some() {
            return Ok(KeeperAnswer::Failed);
        }
        (self.bound, self.open) = (None, None);
        let Some(sector) = self.erased.unwrap_or(self.sectors).checked_sub(1) else {
            self.erased = None;
            return Ok(KeeperAnswer::None);
        };
        let mut blank = 0;
        while blank < SECTOR_BYTES && self.is_blank(sector * SECTOR_BYTES + blank)? {
            blank += PROGRAM_BYTES;
        }
        if blank < SECTOR_BYTES {
            self.flash.erase(sector)?;
        }
        self.erased = Some(sector);
        if sector <= self.ahead.sector {
            self.ahead = Ahead { sector, blank: SECTOR_BYTES };
            self.state = StorageState::Ready;
        }
        Ok(KeeperAnswer::Is(1))
    }
}

impl LogKeeper for FlashKeeper<'_> {
    fn state(&self) -> StorageState {
        self.state
    }

    fn poll(&mut self, now_us: u64) {
        self.now_us = now_us;
        if !self.works() && now_us >= self.retry_us {
            self.attempt(&mut Self::start);
        } else if self.state == StorageState::Ready && self.written.is_none() {
            self.attempt(&mut |keeper| keeper.look_ahead(IDLE_LOOK_BYTES));
        }
    }

    fn take(&mut self, now_us: u64, block: &LogBlock) {
        self.now_us = now_us;
        if block.begins() {
            // The previous log may have had no last block.
            self.end();
            self.erased = None;
            if self.state == StorageState::Ready {
                let log = self.next;
                self.next = log.saturating_add(1);
                self.attempt(&mut |keeper| keeper.begin(Head { log, part: 0 }));
            }
        }
        if self.written.is_some() {
            self.attempt(&mut |keeper| keeper.append(block.bytes()));
        }
        if block.ends() {
            self.end();
        }
    }

    fn answer(&mut self, now_us: u64, query: LogQuery, page: &mut LogPage) {
        self.now_us = now_us;
        (page.query, page.answer) = (query, KeeperAnswer::Failed);
        if !self.works() {
            return;
        }
        self.attempt(&mut |keeper| {
            page.answer = match query {
                LogQuery::Nothing => KeeperAnswer::None,
                LogQuery::Count => keeper.count()?,
                LogQuery::Size(place) => {
                    keeper.find(place)?.map_or(KeeperAnswer::None, |stretch| KeeperAnswer::Is(stretch.bytes))
                }
                LogQuery::Read(place, offset) => keeper.read(place, offset, &mut page.bytes)?,
                LogQuery::Erase => keeper.erase_one()?,
            };
            Ok(())
        });
    }
}

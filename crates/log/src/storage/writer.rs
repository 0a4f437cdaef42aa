//! Turns ticks into blocks of a log.

use crate::storage::block::{BLOCK_BYTES, BlockSink};
use crate::storage::keeper::StorageState;
use crate::ulog::{BesideTick, BlackBox, LogRing, LogStart};
use afbc_onboard::parameters::{ParameterTable, RecordChange};
use afbc_onboard::{LogMode, TickRecord};

/// Size of the ring of bytes that wait for a block. It holds a tick in which every topic is due, and the unfinished
/// block before.
pub const STAGING: usize = 2560;
/// Largest number of entries of a log's beginning handled in one tick. Each entry is looked up in the vehicle's table,
/// and the task has other work.
const PACE: u16 = 2;
/// Time for which a log continues after the vehicle is disarmed \[us\].
const TAIL_US: u64 = 1_000_000;

/// Writes the logs of a vehicle into blocks.
#[derive(Clone, Debug, Default)]
pub struct LogWriter {
    /// The log being written.
    log: Option<BlackBox>,
    ring: LogRing<STAGING>,
    /// True until the log's first block is sent.
    begins: bool,
    /// True once the log is complete and only waits to be sent.
    ends: bool,
    /// Time of the last tick in which the vehicle was armed \[us\].
    armed_us: Option<u64>,
    /// Time of the last tick \[us\].
    ticked_us: Option<u64>,
    /// State of the storage that stations were told last.
    told: StorageState,
    /// True for small logs.
    small: bool,
}

impl LogWriter {
    /// Creates the writer, without a log. `small` selects small logs, for a storage that holds only minutes
    /// ([`BlackBox::small`]).
    pub const fn new(small: bool) -> Self {
        LogWriter {
            log: None,
            ring: LogRing::new(),
            begins: false,
            ends: false,
            armed_us: None,
            ticked_us: None,
            told: StorageState::Unknown,
            small,
        }
    }

    /// Returns true if a tick at this time belongs into a log. Then call [`tick`](Self::tick). Call this once in every
    /// tick.
    pub fn wants(&mut self, now_us: u64, armed: bool, mode: LogMode) -> bool {
        if armed {
            self.armed_us = Some(now_us);
        }
        let is_recent = self.armed_us.is_some_and(|armed_us| now_us.saturating_sub(armed_us) < TAIL_US);
        let wanted = match mode {
            LogMode::Armed => is_recent,
            LogMode::BootUntilDisarm => is_recent || self.armed_us.is_none(),
            LogMode::Boot => true,
        };
        // A finished log is sent completely before the next one begins.
        self.ends |= self.log.is_some() && !wanted;
        wanted && !self.ends
    }

    /// Writes a tick into the log. Begins a log, described by `start`, if the storage is ready and there is none. A gap
    /// of more than one and a half `period_us` since the last tick is logged as a dropout.
    pub fn tick(
        &mut self,
        (tick, beside): (&TickRecord<'_>, &BesideTick<'_>),
        table: &ParameterTable,
        start: &LogStart<'_>,
        storage: StorageState,
        period_us: u64,
    ) {
        if self.log.is_none() && storage == StorageState::Ready && !self.ends {
            (self.begins, self.ticked_us) = (true, None);
            // A log that was given up may have left bytes in the ring.
            self.ring = LogRing::new();
            let log = BlackBox::new(start, table).paced(PACE);
            self.log = Some(if self.small { log.small() } else { log });
        }
        let Some(log) = self.log.as_mut().filter(|_| !self.ends) else { return };
        let now_us = tick.report.time_us;
        if let Some(due_us) = self.ticked_us.map(|ticked_us| ticked_us.saturating_add(period_us))
            // Half a period of tolerance: no tick comes that early or late.
            && now_us > due_us.saturating_add(period_us / 2)
        {
            log.miss(due_us);
        }
        self.ticked_us = Some(now_us);
        log.tick(tick, beside, table, &mut self.ring);
    }

    /// Writes a parameter change. Call it after the table has changed.
    pub fn change(&mut self, table: &ParameterTable, change: RecordChange) {
        if let Some(log) = &mut self.log {
            log.change(table, change, &mut self.ring);
        }
    }

    /// Writes a text of this severity (0 emergency to 7 debug).
    pub fn text(&mut self, now_us: u64, severity: u8, text: &str) {
        if let Some(log) = &mut self.log {
            log.text(now_us, severity, text, &mut self.ring);
        }
    }

    /// Hands full blocks to `sink`, and the whole rest of a finished log. Call it in every tick. Gives up the log if
    /// the storage is not ready any more.
    pub fn send(&mut self, sink: &mut impl BlockSink, storage: StorageState) {
        if self.log.is_some() && storage != StorageState::Ready {
            (self.log, self.ends) = (None, false);
        }
        if self.log.is_none() {
            self.ends = false;
            return;
        }
        while self.ring.len() >= BLOCK_BYTES || self.ends {
            let Some(block) = sink.free() else { return };
            let is_last = self.ends && self.ring.len() <= BLOCK_BYTES;
            block.clear(self.begins, is_last);
            // The ring's bytes may lie in two pieces: up to the memory's end, and from its beginning.
            for _ in 0..2 {
                let count = block.append(self.ring.front());
                self.ring.consume(count);
            }
            sink.done();
            self.begins = false;
            if is_last {
                (self.log, self.ends) = (None, false);
            }
        }
    }

    /// Returns a text for ground stations when the storage's state has changed, and true if the text is a warning.
    /// `Ready` is reported only after another state was.
    pub fn news(&mut self, storage: StorageState) -> Option<(&'static str, bool)> {
        if storage == self.told || storage == StorageState::Unknown {
            return None;
        }
        // At the first start, a ready storage is no news.
        let is_news = !(self.told == StorageState::Unknown && storage == StorageState::Ready);
        self.told = storage;
        let text = storage.text().filter(|_| is_news)?;
        Some((text, storage != StorageState::Ready))
    }
}

//! From ticks to blocks.

use crate::storage::block::{BLOCK_BYTES, BlockSink};
use crate::storage::keeper::StorageState;
use crate::ulog::{BesideTick, BlackBox, LogRing, LogStart};
use afbc_onboard::parameters::{ParameterTable, RecordChange};
use afbc_onboard::{LogMode, TickRecord};

/// Bytes that wait for a block, at most: more than a tick in which every topic is due writes, beside what does not
/// fill one.
pub const STAGING: usize = 2560;
/// Entries of a log's beginning that are looked at in a tick, at most: each is searched for in the vehicle's table, and
/// the task that hears of ticks has other things to do.
const PACE: u16 = 2;
/// Time for which a log goes on once the vehicle is disarmed \[us\].
const TAIL_US: u64 = 1_000_000;

/// Writes the logs of a vehicle into blocks.
#[derive(Clone, Debug, Default)]
pub struct LogWriter {
    /// The log that is being written.
    log: Option<BlackBox>,
    ring: LogRing<STAGING>,
    /// True until its first block has gone.
    begins: bool,
    /// True once it only has to leave.
    ends: bool,
    /// When the vehicle was armed last \[us\].
    armed_us: Option<u64>,
    /// When the last tick was \[us\].
    ticked_us: Option<u64>,
    /// What stations know of the storage.
    told: StorageState,
    /// True if logs are to be small.
    small: bool,
}

impl LogWriter {
    /// Creates it, with no log, for small logs, where there is room for minutes only ([`BlackBox::small`]), or usual
    /// ones.
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

    /// True if a log is being written, or would be with a storage that is ready: then [`tick`](Self::tick) is to be
    /// called for every tick. To be asked once in each.
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
        // A log that has ended leaves before the next begins.
        self.ends |= self.log.is_some() && !wanted;
        wanted && !self.ends
    }

    /// Writes a tick, into the log of a vehicle as `start` has it, if the storage takes one. Ticks that are missing
    /// before it, more than `period_us` apart, count as a dropout.
    pub fn tick<const M: usize, const N: usize>(
        &mut self,
        (tick, beside): (&TickRecord<'_, M>, &BesideTick<'_>),
        table: &ParameterTable<N>,
        start: &LogStart<'_>,
        storage: StorageState,
        period_us: u64,
    ) {
        if self.log.is_none() && storage == StorageState::Ready && !self.ends {
            (self.begins, self.ticked_us) = (true, None);
            // A log that was given up has left bytes.
            self.ring = LogRing::new();
            let log = BlackBox::new(start, table).paced(PACE);
            self.log = Some(if self.small { log.small() } else { log });
        }
        let Some(log) = self.log.as_mut().filter(|_| !self.ends) else { return };
        let now_us = tick.report.time_us;
        if let Some(due_us) = self.ticked_us.map(|ticked_us| ticked_us.saturating_add(period_us))
            // Half a period: no tick is that early or late.
            && now_us > due_us.saturating_add(period_us / 2)
        {
            log.miss(due_us);
        }
        self.ticked_us = Some(now_us);
        log.tick(tick, beside, table, &mut self.ring);
    }

    /// Writes a change of the parameters, to be called after it.
    pub fn change<const N: usize>(&mut self, table: &ParameterTable<N>, change: RecordChange) {
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

    /// Hands over what fills blocks, and all that is left of a log that has ended; to be called in every tick. A log
    /// whose storage is not ready any more is given up.
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
            // Twice: the ring's end, and its beginning.
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

    /// Returns a text for stations when there is something new about the storage, and whether it is a warning. That a
    /// storage is ready is told only after it was not.
    pub fn news(&mut self, storage: StorageState) -> Option<(&'static str, bool)> {
        if storage == self.told || storage == StorageState::Unknown {
            return None;
        }
        // What has failed is tried again, which does not tell more of it.
        let is_news = !(self.told == StorageState::Unknown && storage == StorageState::Ready);
        self.told = storage;
        let text = storage.text().filter(|_| is_news)?;
        Some((text, storage != StorageState::Ready))
    }
}

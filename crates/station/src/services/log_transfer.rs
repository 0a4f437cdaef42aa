//! Logs by LOG_REQUEST_LIST, LOG_REQUEST_DATA, LOG_REQUEST_END and LOG_ERASE.
//!
//! None of their messages names a receiver, so that one list and one log are sent at a time: what was asked for last.
//! Only of one log several short parts wait for one another, as stations ask for what they have missed.

use super::storage::LogStore;
use afbc_link::{LOG_DATA_MAX, LogData, LogEntry, LogRequest};
use heapless::Deque;

/// Parts of a log that wait; then the oldest is dropped.
const PARTS_MAX: usize = 20;
/// Longest part that another one waits for \[bytes\].
const SHORT: u32 = 1 << 20;

/// What is being sent.
#[derive(Clone, Debug, Default)]
pub struct LogTransfer {
    /// How many logs there are, and the next and the last one to be listed.
    listing: Option<[u16; 3]>,
    parts: Deque<Part, PARTS_MAX>,
}

/// A part of a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Part {
    log: u16,
    offset: u32,
    /// Bytes that are left.
    left: u32,
}

/// A message about logs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(clippy::large_enum_variant, reason = "one at a time")]
pub enum LogMessage {
    /// One of the logs.
    Entry(LogEntry),
    /// A part of one.
    Data(LogData),
}

impl LogTransfer {
    /// Takes a request, except to erase logs. A request for anything ends what is being sent of its kind.
    pub fn hear(&mut self, request: LogRequest, store: &mut impl LogStore) {
        match request {
            LogRequest::List { first, last } => {
                let count = store.count_logs();
                let newest = count.saturating_sub(1);
                let first = first.min(newest);
                self.listing = Some([count, first, last.clamp(first, newest)]);
            }
            LogRequest::Data { log, offset, bytes } => {
                let part = Part { log, offset, left: bytes };
                if self.parts.iter().chain([&part]).any(|it| it.log != log || it.left > SHORT) {
                    self.parts.clear();
                }
                if !self.parts.iter().any(|it| *it == part) {
                    if self.parts.is_full() {
                        self.parts.pop_front();
                    }
                    self.parts.push_back(part).ok();
                }
            }
            LogRequest::End | LogRequest::Erase => *self = LogTransfer::default(),
            // Of a streamed log.
            LogRequest::Received(_) => {}
        }
    }

    /// True while there is a [next](Self::next) message.
    pub fn is_busy(&self) -> bool {
        self.listing.is_some() || !self.parts.is_empty()
    }

    /// Returns the next message.
    pub fn next(&mut self, store: &mut impl LogStore) -> Option<LogMessage> {
        if let Some([count, next, last]) = self.listing {
            self.listing = (next < last).then_some([count, next.saturating_add(1), last]);
            let info = store.log(next);
            let (utc_s, size) = info.map_or((0, 0), |info| (info.utc_s, info.size));
            let newest = count.saturating_sub(1);
            return Some(LogMessage::Entry(LogEntry { log: next, count, last: newest, utc_s, size }));
        }
        let Part { log, offset, left } = self.parts.pop_front()?;
        let mut data = [0; LOG_DATA_MAX];
        let wanted = LOG_DATA_MAX.min(left as usize);
        let into = data.get_mut(..wanted).unwrap_or_default();
        let count = store.read_log(log, offset, into).min(wanted);
        let (offset_then, left) = (offset.saturating_add(count as u32), left - count as u32);
        // A part that is not full tells the end of the log; behind the last full one, an empty one.
        if count == LOG_DATA_MAX && left > 0 {
            self.parts.push_front(Part { log, offset: offset_then, left }).ok();
        }
        Some(LogMessage::Data(LogData { log, offset, count: count as u8, data }))
    }
}

//! Log download: LOG_REQUEST_LIST, LOG_REQUEST_DATA, LOG_REQUEST_END and LOG_ERASE.
//!
//! The answers have no target address, so only one list and one log are sent at a time: those requested last. A station
//! asks again for pieces of a log that it has missed, so several short parts of the same log can be queued.

use super::storage::LogStore;
pub use afbc_mavlink::LogMessage;
use afbc_mavlink::{LOG_DATA_MAX, LogData, LogEntry, LogRequest};
use core::task::Poll;
use heapless::Deque;

/// Largest number of queued parts of a log. A further part replaces the oldest.
const PARTS_MAX: usize = 20;
/// Longest part that can be queued with other parts \[bytes\]. A longer part replaces them.
const SHORT: u32 = 1 << 20;

/// Requested list and parts of a log.
#[derive(Clone, Debug, Default)]
pub struct LogTransfer {
    /// List that is being sent.
    listing: Option<Listing>,
    parts: Deque<LogPart, PARTS_MAX>,
}

/// A requested list of logs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Listing {
    /// First and last log requested. The logs have not been counted yet.
    Wanted([u16; 2]),
    /// Number of logs, and the next and the last log to be listed.
    Counted([u16; 3]),
}

/// A requested part of a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct LogPart {
    log: u16,
    offset: u32,
    /// Number of bytes left.
    left: u32,
}

impl LogTransfer {
    /// Handles a request. A new list replaces the old list, a new log the old log. LOG_ERASE only ends all transfers:
    /// the caller erases the logs.
    pub fn hear(&mut self, request: LogRequest) {
        match request {
            LogRequest::List { first, last } => self.listing = Some(Listing::Wanted([first, last])),
            LogRequest::Data { log, offset, bytes } => {
                let part = LogPart { log, offset, left: bytes };
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
            // This acknowledges a log stream.
            LogRequest::Received(_) => {}
        }
    }

    /// Returns true while a [next](Self::next) message is ready or expected.
    pub fn is_busy(&self) -> bool {
        self.listing.is_some() || !self.parts.is_empty()
    }

    /// Returns the next message. Returns none also while the storage is busy.
    pub fn next(&mut self, store: &mut (impl LogStore + ?Sized)) -> Option<LogMessage> {
        if let Some(Listing::Wanted([first, last])) = self.listing {
            let Poll::Ready(count) = store.count_logs() else { return None };
            let newest = count.saturating_sub(1);
            // `clamp` would panic if the first log were beyond the last one.
            let first = first.min(newest);
            self.listing = Some(Listing::Counted([count, first, last.clamp(first, newest)]));
        }
        if let Some(Listing::Counted([count, next, last])) = self.listing {
            let Poll::Ready(info) = store.log(next) else { return None };
            self.listing = (next < last).then_some(Listing::Counted([count, next.saturating_add(1), last]));
            let (utc_s, size) = info.map_or((0, 0), |info| (info.utc_s, info.size));
            let newest = count.saturating_sub(1);
            return Some(LogMessage::Entry(LogEntry { log: next, count, last: newest, utc_s, size }));
        }
        let LogPart { log, offset, left } = *self.parts.front()?;
        let mut data = [0; LOG_DATA_MAX];
        let wanted = LOG_DATA_MAX.min(left as usize);
        let into = data.get_mut(..wanted).unwrap_or_default();
        let Poll::Ready(count) = store.read_log(log, offset, into) else { return None };
        // The part is removed only now: while the storage was busy it had to stay.
        self.parts.pop_front();
        let count = count.min(wanted);
        // No underflow: `count` is at most `wanted`, which is at most `left`.
        let (offset_then, left) = (offset.saturating_add(count as u32), left - count as u32);
        // LOG_DATA that is not full marks the end of the log. If the log's last LOG_DATA is full, an empty LOG_DATA
        // follows.
        if count == LOG_DATA_MAX && left > 0 {
            self.parts.push_front(LogPart { log, offset: offset_then, left }).ok();
        }
        Some(LogMessage::Data(LogData { log, offset, count: count as u8, data }))
    }
}

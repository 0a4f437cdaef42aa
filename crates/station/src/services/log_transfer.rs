//! Logs by LOG_REQUEST_LIST, LOG_REQUEST_DATA, LOG_REQUEST_END and LOG_ERASE.
//!
//! None of their messages names a receiver, so that one list and one log are sent at a time: what was asked for last.
//! Only of one log several short parts wait for one another, as stations ask for what they have missed.

use super::storage::LogStore;
pub use afbc_link::LogMessage;
use afbc_link::{LOG_DATA_MAX, LogData, LogEntry, LogRequest};
use core::task::Poll;
use heapless::Deque;

/// Parts of a log that wait; then the oldest is dropped.
const PARTS_MAX: usize = 20;
/// Longest part that another one waits for \[bytes\].
const SHORT: u32 = 1 << 20;

/// What is being sent.
#[derive(Clone, Debug, Default)]
pub struct LogTransfer {
    /// What is to be listed.
    listing: Option<Listing>,
    parts: Deque<Part, PARTS_MAX>,
}

/// A list of logs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Listing {
    /// From the first to the last one wanted; they are to be counted.
    Wanted([u16; 2]),
    /// How many logs there are, and the next and the last one to be listed.
    Counted([u16; 3]),
}

/// A part of a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Part {
    log: u16,
    offset: u32,
    /// Bytes that are left.
    left: u32,
}

impl LogTransfer {
    /// Takes a request, except to erase logs. A request for anything ends what is being sent of its kind.
    pub fn hear(&mut self, request: LogRequest) {
        match request {
            LogRequest::List { first, last } => self.listing = Some(Listing::Wanted([first, last])),
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

    /// True while there is a [next](Self::next) message, or will be one.
    pub fn is_busy(&self) -> bool {
        self.listing.is_some() || !self.parts.is_empty()
    }

    /// Returns the next message; none also while the logs have to be waited for.
    pub fn next(&mut self, store: &mut (impl LogStore + ?Sized)) -> Option<LogMessage> {
        if let Some(Listing::Wanted([first, last])) = self.listing {
            let Poll::Ready(count) = store.count_logs() else { return None };
            let newest = count.saturating_sub(1);
            // Not beyond the last: `clamp` panics if its limits are the wrong way round.
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
        let Part { log, offset, left } = *self.parts.front()?;
        let mut data = [0; LOG_DATA_MAX];
        let wanted = LOG_DATA_MAX.min(left as usize);
        let into = data.get_mut(..wanted).unwrap_or_default();
        let Poll::Ready(count) = store.read_log(log, offset, into) else { return None };
        // Only now: while the store is waited for, the part is asked for again.
        self.parts.pop_front();
        let count = count.min(wanted);
        // No underflow: `count` is at most `wanted`, and that at most `left`.
        let (offset_then, left) = (offset.saturating_add(count as u32), left - count as u32);
        // A part that is not full tells the end of the log; behind the last full one, an empty one.
        if count == LOG_DATA_MAX && left > 0 {
            self.parts.push_front(Part { log, offset: offset_then, left }).ok();
        }
        Some(LogMessage::Data(LogData { log, offset, count: count as u8, data }))
    }
}

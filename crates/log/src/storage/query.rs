//! Queries about stored logs, from a task that must not block on the storage to the task that may.

use afbc_comms::services::storage::{LogInfo, LogStore};
use core::task::Poll;

/// Bytes of a log read at once: five parts of a download.
pub const PAGE_BYTES: usize = 450;

/// A query about the stored logs, without the log being written. A log is addressed by its place in the order of the
/// directory. Places stay valid until the logs are counted again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LogQuery {
    /// No query.
    #[default]
    Nothing,
    /// The number of logs.
    Count,
    /// The size of the log at this place \[bytes\].
    Size(u16),
    /// The content of the log at this place, from this offset on.
    Read(u16, u32),
    /// Erase one log, or one sector of flash.
    Erase,
}

/// The answer to a query.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum KeeperAnswer {
    /// There is no such log. For [`LogQuery::Erase`]: nothing is left to erase.
    #[default]
    None,
    /// The requested number. For [`LogQuery::Read`], this is the number of bytes read: less than a page at the log's
    /// end.
    Is(u32),
    /// The storage has failed or refused.
    Failed,
}

/// A query with its answer.
#[derive(Clone, Debug)]
pub struct LogPage {
    pub(crate) query: LogQuery,
    pub(crate) answer: KeeperAnswer,
    /// The bytes that were read.
    pub(crate) bytes: [u8; PAGE_BYTES],
}

impl LogPage {
    /// A page without a query.
    pub const EMPTY: Self = LogPage { query: LogQuery::Nothing, answer: KeeperAnswer::None, bytes: [0; PAGE_BYTES] };

    /// Copies bytes of the page that begin at `offset` of the log. Returns none if the page was not read, or holds too
    /// few of them although the log continues.
    fn copy(&self, place: u16, offset: u32, into: &mut [u8]) -> Option<usize> {
        let LogQuery::Read(at, from) = self.query else { return None };
        let skipped = offset.checked_sub(from).filter(|_| at == place)? as usize;
        let length = match self.answer {
            KeeperAnswer::Is(length) => (length as usize).min(PAGE_BYTES),
            KeeperAnswer::None => 0,
            // A failure is not the log's end: the storage may recover.
            KeeperAnswer::Failed => return None,
        };
        let rest = self.bytes.get(skipped..length).unwrap_or_default();
        let is_end = length < PAGE_BYTES && skipped <= length;
        if rest.len() < into.len() && !is_end {
            return None;
        }
        into.iter_mut().zip(rest).for_each(|(to, byte)| *to = *byte);
        Some(rest.len().min(into.len()))
    }
}

/// Channels between the task that reads logs and the task that owns the storage: a queue of one page, and one of
/// queries.
pub trait LogPages {
    /// Returns the page in the queue, if there is one.
    fn page(&mut self) -> Option<&LogPage>;

    /// Releases the page.
    fn done(&mut self);

    /// Sends a query, which replaces an earlier one.
    fn ask(&mut self, query: LogQuery);
}

/// Gives the station services access to the stored logs.
#[derive(Clone, Debug)]
pub struct KeptLogs<P> {
    pages: P,
    /// The query that has no answer yet.
    asked: LogQuery,
}

impl<P: LogPages> KeptLogs<P> {
    /// Creates it without a query.
    pub fn new(pages: P) -> Self {
        KeptLogs { pages, asked: LogQuery::Nothing }
    }

    /// Sends the query, unless it is already waiting for its answer.
    fn wait_for(&mut self, query: LogQuery) {
        if self.asked != query {
            self.asked = query;
            self.pages.ask(query);
        }
    }

    /// Returns the query's answer if there is one, else sends the query.
    #[inline(never)]
    fn ask(&mut self, query: LogQuery) -> Poll<KeeperAnswer> {
        let answered = self.pages.page().map(|page| (page.query, page.answer));
        if answered.is_some() {
            self.pages.done();
        }
        match answered {
            Some((of, answer)) if of == query => {
                self.asked = LogQuery::Nothing;
                Poll::Ready(answer)
            }
            _ => {
                self.wait_for(query);
                Poll::Pending
            }
        }
    }
}

impl<P: LogPages> LogStore for KeptLogs<P> {
    fn count_logs(&mut self) -> Poll<u16> {
        self.ask(LogQuery::Count).map(|answer| match answer {
            KeeperAnswer::Is(count) => u16::try_from(count).unwrap_or(u16::MAX),
            KeeperAnswer::None | KeeperAnswer::Failed => 0,
        })
    }

    fn log(&mut self, place: u16) -> Poll<Option<LogInfo>> {
        self.ask(LogQuery::Size(place)).map(|answer| match answer {
            KeeperAnswer::Is(size) => Some(LogInfo { size, utc_s: 0 }),
            KeeperAnswer::None | KeeperAnswer::Failed => None,
        })
    }

    fn read_log(&mut self, place: u16, offset: u32, into: &mut [u8]) -> Poll<usize> {
        // The page stays in the queue, for the next read may need more of it.
        let copied = self.pages.page().map(|page| page.copy(place, offset, into));
        if let Some(Some(count)) = copied {
            self.asked = LogQuery::Nothing;
            return Poll::Ready(count);
        }
        if copied.is_some() {
            self.pages.done();
            self.asked = LogQuery::Nothing;
        }
        self.wait_for(LogQuery::Read(place, offset));
        Poll::Pending
    }

    fn erase_logs(&mut self) -> Poll<bool> {
        match self.ask(LogQuery::Erase) {
            Poll::Ready(KeeperAnswer::None) => Poll::Ready(true),
            Poll::Ready(KeeperAnswer::Failed) => Poll::Ready(false),
            // Logs are erased one by one, so that the blocks of a log never wait for all of them.
            Poll::Ready(KeeperAnswer::Is(_)) => {
                self.wait_for(LogQuery::Erase);
                Poll::Pending
            }
            Poll::Pending => Poll::Pending,
        }
    }
}

//! What is asked of kept logs, by a task that cannot wait for card or flash, and answered by the one that can.

use afbc_station::services::storage::{LogInfo, LogStore};
use core::task::Poll;

/// Bytes of a log that are read at once: five parts of a download.
pub const PAGE_BYTES: usize = 450;

/// A question about the logs that are kept, except the one that is being written. Each has its place, in the order of
/// the directory, which it keeps until they are counted again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LogQuery {
    /// None.
    #[default]
    Nothing,
    /// How many there are.
    Count,
    /// The size of the one at this place \[bytes\].
    Size(u16),
    /// What is in the one at this place, from this byte on.
    Read(u16, u32),
    /// That one of them be erased.
    Erase,
}

/// The answer to a question.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum KeeperAnswer {
    /// There is no such log; of [`LogQuery::Erase`], none is left.
    #[default]
    None,
    /// The number that was asked for; of [`LogQuery::Read`], of the bytes that were read: fewer than a page at the end.
    Is(u32),
    /// The storage does not do it.
    Failed,
}

/// A question with its answer.
#[derive(Clone, Debug)]
pub struct LogPage {
    pub(crate) query: LogQuery,
    pub(crate) answer: KeeperAnswer,
    /// What was read.
    pub(crate) bytes: [u8; PAGE_BYTES],
}

impl LogPage {
    /// Without a question.
    pub const EMPTY: Self = LogPage { query: LogQuery::Nothing, answer: KeeperAnswer::None, bytes: [0; PAGE_BYTES] };

    /// Copies what was read from `offset` on; none if it is not on this page, not all of what fits, or was not read.
    fn copy(&self, place: u16, offset: u32, into: &mut [u8]) -> Option<usize> {
        let LogQuery::Read(at, from) = self.query else { return None };
        let skipped = offset.checked_sub(from).filter(|_| at == place)? as usize;
        let length = match self.answer {
            KeeperAnswer::Is(length) => (length as usize).min(PAGE_BYTES),
            KeeperAnswer::None => 0,
            // Not the end of the log: it goes on once the storage does.
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

/// A queue of one page, from the task that waits for it, and one of questions to it.
pub trait LogPages {
    /// Returns the page that is there, if one is.
    fn page(&mut self) -> Option<&LogPage>;

    /// Gives it back.
    fn done(&mut self);

    /// Asks, in the place of what was asked before.
    fn ask(&mut self, query: LogQuery);
}

/// The logs that are kept, as the services for stations want them.
#[derive(Clone, Debug)]
pub struct KeptLogs<P> {
    pages: P,
    /// What is asked and not answered.
    asked: LogQuery,
}

impl<P: LogPages> KeptLogs<P> {
    /// With nothing asked.
    pub fn new(pages: P) -> Self {
        KeptLogs { pages, asked: LogQuery::Nothing }
    }

    /// Asks, once until there is an answer.
    fn wait_for(&mut self, query: LogQuery) {
        if self.asked != query {
            self.asked = query;
            self.pages.ask(query);
        }
    }

    /// Asks, or returns the answer, once.
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
        // The page stays for what follows on it.
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
            // One at a time, so that blocks of a log are not kept waiting for all of them.
            Poll::Ready(KeeperAnswer::Is(_)) => {
                self.wait_for(LogQuery::Erase);
                Poll::Pending
            }
            Poll::Pending => Poll::Pending,
        }
    }
}

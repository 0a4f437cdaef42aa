//! What keeps logs.

use crate::storage::block::LogBlock;
use crate::storage::query::{LogPage, LogQuery};

/// Keeps the blocks of logs, and gives logs back. It may wait for its card or flash in every call but
/// [`state`](Self::state).
///
/// A keeper holds its card or flash as a trait object: what is generic is compiled in the crate that uses it, a
/// board's, for speed and not for size.
pub trait LogKeeper {
    /// Returns what is known of the card or flash.
    fn state(&self) -> StorageState;

    /// Looks after a card that is not ready, to be called several times a second while there is no block.
    fn poll(&mut self, now_us: u64);

    /// Keeps a block. Without room for its log, or after a failure, those up to the beginning of the next log are lost.
    fn take(&mut self, now_us: u64, block: &LogBlock);

    /// Answers a question about the logs but the one that is being written, on a page.
    fn answer(&mut self, now_us: u64, query: LogQuery, page: &mut LogPage);
}

/// What is known of the card or flash.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum StorageState {
    /// Nothing yet.
    #[default]
    Unknown,
    /// It can take a log.
    Ready,
    /// There is no card.
    Absent,
    /// The card has no volume of FAT16 or FAT32 in its first partition.
    Foreign,
    /// It is full.
    Full,
    /// It has failed, and is tried again.
    Failed,
}

impl StorageState {
    /// All of them, each at the place of its number.
    pub const ALL: [Self; 6] = [
        StorageState::Unknown,
        StorageState::Ready,
        StorageState::Absent,
        StorageState::Foreign,
        StorageState::Full,
        StorageState::Failed,
    ];

    /// Returns the state of this number, unknown for any other.
    pub fn of(number: u8) -> Self {
        Self::ALL.get(usize::from(number)).copied().unwrap_or_default()
    }

    /// Returns what stations are told of it, in at most 50 characters; none if there is nothing to tell.
    pub fn text(self) -> Option<&'static str> {
        match self {
            StorageState::Unknown => None,
            StorageState::Ready => Some("Log: ready"),
            StorageState::Absent => Some("Log: no card"),
            StorageState::Foreign => Some("Log: no FAT16 or FAT32 on the card"),
            StorageState::Full => Some("Log: full until logs are erased"),
            StorageState::Failed => Some("Log: storage has failed"),
        }
    }
}

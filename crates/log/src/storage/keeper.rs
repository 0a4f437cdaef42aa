//! Interface of a storage for logs.

use crate::storage::block::LogBlock;
use crate::storage::query::{LogPage, LogQuery};

/// Stores the blocks of logs, and reads logs back. Every call except [`state`](Self::state) may block on the card or
/// flash.
///
/// A keeper holds its card or flash as a trait object. Generic code would be compiled in the board's crate, which
/// optimises for speed, not for size.
pub trait LogKeeper {
    /// Returns the state of the card or flash.
    fn state(&self) -> StorageState;

    /// Restarts a failed card or flash and does background work. Call it several times a second while no block waits.
    fn poll(&mut self, now_us: u64);

    /// Stores a block. If there is no room, or after a failure, all blocks up to the beginning of the next log are
    /// lost.
    fn take(&mut self, now_us: u64, block: &LogBlock);

    /// Answers a query about all logs except the one being written. Writes the answer into `page`.
    fn answer(&mut self, now_us: u64, query: LogQuery, page: &mut LogPage);
}

/// State of the card or flash.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum StorageState {
    /// Not known yet.
    #[default]
    Unknown,
    /// Ready for a log.
    Ready,
    /// There is no card.
    Absent,
    /// The card's first partition holds no intact FAT16 or FAT32 volume.
    Foreign,
    /// Full.
    Full,
    /// Failed; started again at intervals.
    Failed,
}

impl StorageState {
    /// All states, each at the index of its number.
    pub const ALL: [Self; 6] = [
        StorageState::Unknown,
        StorageState::Ready,
        StorageState::Absent,
        StorageState::Foreign,
        StorageState::Full,
        StorageState::Failed,
    ];

    /// Returns the state with this number, or [`Unknown`](Self::Unknown) for any other number.
    pub fn of(number: u8) -> Self {
        Self::ALL.get(usize::from(number)).copied().unwrap_or_default()
    }

    /// Returns the text for ground stations, at most 50 characters, or none if there is nothing to report.
    pub fn text(self) -> Option<&'static str> {
        match self {
            StorageState::Unknown => None,
            StorageState::Ready => Some("Log: ready"),
            StorageState::Absent => Some("Log: no card"),
            StorageState::Foreign => Some("Log: the card has no FAT16 or FAT32"),
            StorageState::Full => Some("Log: storage full, erase logs"),
            StorageState::Failed => Some("Log: storage has failed"),
        }
    }
}

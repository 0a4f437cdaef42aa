//! The card, and what is known of it.

use embedded_sdmmc::Block;

/// Why a card does not do something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CardError {
    /// There is none, or it does not answer.
    Absent,
    /// It has refused, taken too long, or its answer is damaged.
    Failed,
    /// A call would touch more blocks than a sound volume has it do.
    Endless,
}

impl core::fmt::Display for CardError {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        formatter.write_str(match self {
            CardError::Absent => "no card",
            CardError::Failed => "the card has failed",
            CardError::Endless => "the volume is damaged",
        })
    }
}

impl core::error::Error for CardError {}

/// A memory card: blocks of 512 bytes by number. Every call may wait for it.
pub trait LogCard {
    /// Begins anew, after a failure or with another card; returns its number of blocks.
    ///
    /// # Errors
    /// If there is no card, or none that works.
    fn start(&mut self) -> Result<u32, CardError>;

    /// Reads a block.
    ///
    /// # Errors
    /// If the card does not do it.
    fn read(&mut self, number: u32, block: &mut Block) -> Result<(), CardError>;

    /// Writes a block, and waits until it is kept.
    ///
    /// # Errors
    /// If the card does not do it; the block may be written or not.
    fn write(&mut self, number: u32, block: &Block) -> Result<(), CardError>;
}

/// What is known of the card.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum CardState {
    /// Nothing yet.
    #[default]
    Unknown,
    /// It can take a log.
    Ready,
    /// There is none.
    Absent,
    /// It has no volume of FAT16 or FAT32 in its first partition.
    Foreign,
    /// It is full.
    Full,
    /// It has failed, and is tried again.
    Failed,
}

impl CardState {
    /// All of them, each at the place of its number.
    pub const ALL: [Self; 6] = [
        CardState::Unknown,
        CardState::Ready,
        CardState::Absent,
        CardState::Foreign,
        CardState::Full,
        CardState::Failed,
    ];

    /// Returns the state of this number, unknown for any other.
    pub fn of(number: u8) -> Self {
        Self::ALL.get(usize::from(number)).copied().unwrap_or_default()
    }

    /// Returns what stations are told of it, in at most 50 characters; none if there is nothing to tell.
    pub fn text(self) -> Option<&'static str> {
        match self {
            CardState::Unknown => None,
            CardState::Ready => Some("Log: card ready"),
            CardState::Absent => Some("Log: no card"),
            CardState::Foreign => Some("Log: no FAT16 or FAT32 on the card"),
            CardState::Full => Some("Log: card full"),
            CardState::Failed => Some("Log: card has failed"),
        }
    }
}

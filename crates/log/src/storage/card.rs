//! Interface to a memory card.

use embedded_sdmmc::Block;

/// Reasons why a call to a card fails.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CardError {
    /// There is no card, or it does not answer.
    Absent,
    /// The card has refused, taken too long, or sent a damaged answer.
    Failed,
    /// The volume is damaged: a call would touch too many blocks, or one that it must not touch.
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

/// A memory card: blocks of 512 bytes, addressed by number. Every call may block until the card is done.
pub trait LogCard: Send {
    /// Initialises the card, at first, after a failure, or after another one is inserted. Returns its number of blocks.
    ///
    /// # Errors
    /// If there is no card, or the card does not work.
    fn start(&mut self) -> Result<u32, CardError>;

    /// Reads a block.
    ///
    /// # Errors
    /// If the card fails.
    fn read(&mut self, number: u32, block: &mut Block) -> Result<(), CardError>;

    /// Writes a block, and waits until it is stored.
    ///
    /// # Errors
    /// If the card fails. The block may be written or not.
    fn write(&mut self, number: u32, block: &Block) -> Result<(), CardError>;
}

//! A memory card.

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
pub trait LogCard: Send {
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

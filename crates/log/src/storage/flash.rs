//! Flash for logs.

/// Bytes that are erased at once.
pub const SECTOR_BYTES: u32 = 65_536;
/// Bytes that are programmed at once, at most, none beyond a multiple of it.
pub const PROGRAM_BYTES: u32 = 256;

/// The flash has refused, taken too long, or does not answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FlashFailed;

impl core::fmt::Display for FlashFailed {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        formatter.write_str("the flash has failed")
    }
}

impl core::error::Error for FlashFailed {}

/// NOR flash of sectors that are erased as a whole. Every call may wait for it.
pub trait LogFlash: Send {
    /// Begins anew, after a reset or a failure; returns its number of sectors.
    ///
    /// # Errors
    /// If there is none that works.
    fn start(&mut self) -> Result<u32, FlashFailed>;

    /// Reads from an address on.
    ///
    /// # Errors
    /// If the flash does not do it.
    fn read(&mut self, address: u32, into: &mut [u8]) -> Result<(), FlashFailed>;

    /// Makes those bits 0 that are 0 in `bytes`, which are of one page, and waits until it is done.
    ///
    /// # Errors
    /// If the flash does not do it; some of it may be done.
    fn program(&mut self, address: u32, bytes: &[u8]) -> Result<(), FlashFailed>;

    /// Makes all bits of a sector 1, and waits until it is done.
    ///
    /// # Errors
    /// If the flash does not do it; the sector's content is unknown then.
    fn erase(&mut self, sector: u32) -> Result<(), FlashFailed>;
}

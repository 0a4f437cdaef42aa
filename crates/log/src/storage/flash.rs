//! Interface to flash for logs.

/// Bytes in a sector, the unit of erasure.
pub const SECTOR_BYTES: u32 = 65_536;
/// Bytes in a page, the unit of programming: one call must not cross a multiple of this number.
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

/// NOR flash whose sectors are erased as a whole. Every call may block until the flash is done.
pub trait LogFlash: Send {
    /// Initialises the flash, at first, or after a reset or a failure. Returns its number of sectors.
    ///
    /// # Errors
    /// If there is no working flash.
    fn start(&mut self) -> Result<u32, FlashFailed>;

    /// Reads the bytes that begin at an address.
    ///
    /// # Errors
    /// If the flash fails.
    fn read(&mut self, address: u32, into: &mut [u8]) -> Result<(), FlashFailed>;

    /// Clears each bit that is 0 in `bytes`, and waits until that is done. The bytes must lie in one page.
    ///
    /// # Errors
    /// If the flash fails. Some bytes may be programmed.
    fn program(&mut self, address: u32, bytes: &[u8]) -> Result<(), FlashFailed>;

    /// Sets all bits of a sector to 1, and waits until that is done.
    ///
    /// # Errors
    /// If the flash fails. The sector's content is then unknown.
    fn erase(&mut self, sector: u32) -> Result<(), FlashFailed>;
}

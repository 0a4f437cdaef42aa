//! Flash simulated in RAM.

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use embedded_storage::nor_flash::{check_erase, check_read, check_write};

/// Two sectors of `SECTOR` bytes in RAM, for values that need not survive a restart.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ram<const SECTOR: usize>([[u8; SECTOR]; 2]);

impl<const SECTOR: usize> Ram<SECTOR> {
    /// Two erased sectors.
    pub const BLANK: Self = Ram([[0xFF; SECTOR]; 2]);

    fn range(&mut self, offset: u32, length: usize) -> &mut [u8] {
        let start = offset as usize;
        self.0.as_flattened_mut().get_mut(start..start.saturating_add(length)).unwrap_or_default()
    }
}

impl<const SECTOR: usize> ErrorType for Ram<SECTOR> {
    type Error = NorFlashErrorKind;
}

impl<const SECTOR: usize> ReadNorFlash for Ram<SECTOR> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        check_read(self, offset, bytes.len())?;
        let range = self.range(offset, bytes.len());
        bytes.iter_mut().zip(range).for_each(|(to, from)| *to = *from);
        Ok(())
    }

    fn capacity(&self) -> usize {
        2 * SECTOR
    }
}

impl<const SECTOR: usize> NorFlash for Ram<SECTOR> {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        check_erase(self, from, to)?;
        self.range(from, to.saturating_sub(from) as usize).fill(0xFF);
        Ok(())
    }

    /// Clears bits only, as flash does.
    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        check_write(self, offset, bytes.len())?;
        self.range(offset, bytes.len()).iter_mut().zip(bytes).for_each(|(to, from)| *to &= from);
        Ok(())
    }
}

//! Flash in a file.

use crate::place::place;
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use embedded_storage::nor_flash::{check_erase, check_read, check_write};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;

/// Bytes of a sector, as the STM32F405's first ones.
const SECTOR: usize = 16 * 1024;
const SECTORS: usize = 2;

/// Two sectors of flash in a file, for a store of parameters.
///
/// A write is on the disk before it returns. A program that is killed leaves what a cut of power leaves in a chip.
#[derive(Debug)]
pub struct Flash(File);

/// Why a [`Flash`] failed.
#[derive(Debug)]
pub enum FlashError {
    /// Outside the file, or not aligned.
    Place(NorFlashErrorKind),
    /// The file.
    File(io::Error),
}

impl From<NorFlashErrorKind> for FlashError {
    fn from(kind: NorFlashErrorKind) -> Self {
        FlashError::Place(kind)
    }
}

impl From<io::Error> for FlashError {
    fn from(error: io::Error) -> Self {
        FlashError::File(error)
    }
}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            FlashError::Place(kind) => *kind,
            FlashError::File(_) => NorFlashErrorKind::Other,
        }
    }
}

impl Flash {
    /// Opens the file at `path`, or makes it with both sectors erased. No other program can open it meanwhile.
    ///
    /// # Errors
    /// If it cannot be written, is in use, or has another size.
    pub fn open(path: &Path) -> io::Result<Self> {
        if !path.exists() {
            // Whole at once: a program that is killed here leaves no store of another size, which would be refused.
            place(path, |out| out.write_all(&[0xFF; SECTORS * SECTOR]))?;
        }
        Flash::known(path)
    }

    /// Opens the file at `path`, which exists.
    ///
    /// # Errors
    /// As [`Flash::open`].
    pub fn known(path: &Path) -> io::Result<Self> {
        let file = OpenOptions::new().read(true).write(true).open(path)?;
        file.try_lock().map_err(|error| match error {
            TryLockError::WouldBlock => io::Error::new(io::ErrorKind::WouldBlock, "in use by another program"),
            TryLockError::Error(error) => error,
        })?;
        let length = file.metadata()?.len();
        if length != (SECTORS * SECTOR) as u64 {
            let problem = format!("no store of parameters: {length} bytes, not {}", SECTORS * SECTOR);
            return Err(io::Error::new(io::ErrorKind::InvalidData, problem));
        }
        Ok(Flash(file))
    }

    fn put(&mut self, offset: u32, bytes: &[u8]) -> io::Result<()> {
        self.0.seek(SeekFrom::Start(offset.into()))?;
        self.0.write_all(bytes)?;
        self.0.sync_data()
    }
}

impl ErrorType for Flash {
    type Error = FlashError;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        check_read(self, offset, bytes.len())?;
        self.0.seek(SeekFrom::Start(offset.into()))?;
        Ok(self.0.read_exact(bytes)?)
    }

    fn capacity(&self) -> usize {
        SECTORS * SECTOR
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        check_erase(self, from, to)?;
        Ok(self.put(from, &vec![0xFF; (to - from) as usize])?)
    }

    /// Clears bits, as flash does.
    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        check_write(self, offset, bytes.len())?;
        let mut held = vec![0; bytes.len()];
        self.read(offset, &mut held)?;
        held.iter_mut().zip(bytes).for_each(|(to, from)| *to &= from);
        Ok(self.put(offset, &held)?)
    }
}

//! Flash memory simulated in a file.

use crate::atomic::write_atomically;
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use embedded_storage::nor_flash::{check_erase, check_read, check_write};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};

/// Size of a sector, that of the first sectors of an STM32F405 \[bytes\].
const SECTOR: usize = 16 * 1024;
const SECTORS: usize = 2;

/// Two sectors of flash in a file, for the parameter store.
///
/// A write is on the disk before it returns, unless the flash writes [in the background](Self::in_background). A killed
/// program leaves the same state in the file as a power cut leaves in a chip.
#[derive(Debug)]
pub struct FlashFile {
    /// Content of the file, including queued writes. The file is locked, so nobody else changes it.
    bytes: Vec<u8>,
    disk: FlashBacking,
}

#[derive(Debug)]
enum FlashBacking {
    File(File),
    Background(FlashWriter),
}

/// Largest number of writes queued for a slow disk. Setting a parameter takes a few writes, and a ground station may
/// set all of them in a row.
const WAITING_MAX: usize = 4096;

/// Background thread that writes in order, each write on the disk before the next. It ends when everything is written.
#[derive(Debug)]
struct FlashWriter {
    queue: Option<SyncSender<(u32, Vec<u8>)>>,
    failure: FlashFailure,
    thread: Option<JoinHandle<()>>,
}

/// The error that stopped background writing. Nothing is written after a failure.
#[derive(Clone, Debug, Default)]
pub struct FlashFailure(Arc<Mutex<FlashFailureState>>);

#[derive(Debug, Default)]
struct FlashFailureState {
    has_failed: bool,
    untold: Option<io::Error>,
}

impl FlashFailure {
    /// Returns the error, the first time only.
    pub fn take(&self) -> Option<FlashError> {
        self.lock().untold.take().map(FlashError::File)
    }

    fn lock(&self) -> MutexGuard<'_, FlashFailureState> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl FlashWriter {
    /// Starts a thread that writes with `put`.
    fn new(mut put: impl FnMut(u32, &[u8]) -> io::Result<()> + Send + 'static) -> io::Result<Self> {
        let (queue, waiting) = sync_channel::<(u32, Vec<u8>)>(WAITING_MAX);
        let failure = FlashFailure::default();
        let told = failure.clone();
        let thread = thread::Builder::new().name("flash".into()).spawn(move || {
            for (offset, bytes) in waiting {
                if let Err(error) = put(offset, &bytes) {
                    *told.lock() = FlashFailureState { has_failed: true, untold: Some(error) };
                    break;
                }
            }
        })?;
        Ok(FlashWriter { queue: Some(queue), failure, thread: Some(thread) })
    }

    /// Queues a write; never waits.
    fn put(&self, offset: u32, bytes: &[u8]) -> io::Result<()> {
        let sent = self.queue.as_ref().map(|queue| queue.try_send((offset, bytes.to_vec())));
        let mut failure = self.failure.lock();
        // A write was lost; later writes would be of no use, so writing stops for good.
        failure.has_failed |= !matches!(sent, Some(Ok(())));
        if failure.has_failed {
            Err(io::Error::other("the disk is too slow for the log, or has failed"))
        } else {
            Ok(())
        }
    }
}

impl Drop for FlashWriter {
    fn drop(&mut self) {
        self.queue = None;
        // The thread returns no result.
        self.thread.take().map(JoinHandle::join);
    }
}

/// Error of a [`FlashFile`].
#[derive(Debug)]
pub enum FlashError {
    /// The address is outside the file, or not aligned.
    Place(NorFlashErrorKind),
    /// The file could not be read or written.
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

impl FlashFile {
    /// Opens the file at `path`, or creates it with both sectors erased. The file is locked against other programs.
    ///
    /// # Errors
    /// If it cannot be written, is in use, or has the wrong size.
    pub fn open(path: &Path) -> io::Result<Self> {
        if !path.exists() {
            // Creates the whole file at once: a program killed here leaves no file of the wrong size, which would be
            // refused later.
            write_atomically(path, |out| out.write_all(&[0xFF; SECTORS * SECTOR]))?;
        }
        FlashFile::open_existing(path)
    }

    /// Opens the file at `path`, which must exist.
    ///
    /// # Errors
    /// The same as for [`FlashFile::open`].
    pub fn open_existing(path: &Path) -> io::Result<Self> {
        let mut file = OpenOptions::new().read(true).write(true).open(path)?;
        file.try_lock().map_err(|error| match error {
            TryLockError::WouldBlock => io::Error::new(io::ErrorKind::WouldBlock, "another program uses the file"),
            TryLockError::Error(error) => error,
        })?;
        let length = file.metadata()?.len();
        if length != (SECTORS * SECTOR) as u64 {
            let problem =
                format!("the file is no parameter store: it has {length} bytes instead of {}", SECTORS * SECTOR);
            return Err(io::Error::new(io::ErrorKind::InvalidData, problem));
        }
        let mut bytes = vec![0; SECTORS * SECTOR];
        file.read_exact(&mut bytes)?;
        Ok(FlashFile { bytes, disk: FlashBacking::File(file) })
    }

    /// Writes in the background from now on, so that no write waits for the disk. Dropping the flash waits until
    /// everything is on the disk, unless writing fails.
    ///
    /// # Errors
    /// If the system cannot start the thread.
    pub fn in_background(self) -> io::Result<(Self, FlashFailure)> {
        let writer = match self.disk {
            FlashBacking::File(mut file) => FlashWriter::new(move |offset, bytes| put(&mut file, offset, bytes))?,
            FlashBacking::Background(writer) => writer,
        };
        let failure = writer.failure.clone();
        Ok((FlashFile { disk: FlashBacking::Background(writer), ..self }, failure))
    }

    fn put(&mut self, offset: u32, bytes: &[u8]) -> io::Result<()> {
        match &mut self.disk {
            FlashBacking::File(file) => put(file, offset, bytes)?,
            FlashBacking::Background(writer) => writer.put(offset, bytes)?,
        }
        let held = self.bytes.iter_mut().skip(offset as usize);
        held.zip(bytes).for_each(|(held, byte)| *held = *byte);
        Ok(())
    }
}

fn put(file: &mut File, offset: u32, bytes: &[u8]) -> io::Result<()> {
    file.seek(SeekFrom::Start(offset.into()))?;
    file.write_all(bytes)?;
    file.sync_data()
}

impl ErrorType for FlashFile {
    type Error = FlashError;
}

impl ReadNorFlash for FlashFile {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        check_read(self, offset, bytes.len())?;
        let held = self.bytes.iter().skip(offset as usize);
        bytes.iter_mut().zip(held).for_each(|(to, held)| *to = *held);
        Ok(())
    }

    fn capacity(&self) -> usize {
        SECTORS * SECTOR
    }
}

impl NorFlash for FlashFile {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        check_erase(self, from, to)?;
        Ok(self.put(from, &vec![0xFF; (to - from) as usize])?)
    }

    /// Clears bits only, like real flash.
    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        check_write(self, offset, bytes.len())?;
        let mut held = vec![0; bytes.len()];
        self.read(offset, &mut held)?;
        held.iter_mut().zip(bytes).for_each(|(to, from)| *to &= from);
        Ok(self.put(offset, &held)?)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;
    use std::sync::mpsc::{Receiver, Sender, channel};

    /// Offset and bytes of a write.
    type Written = (u32, Vec<u8>);

    /// Returns a flash with a test disk, the channel that controls the disk and the writes it has received. The disk
    /// takes one write per `true` and fails on `false`.
    fn slow() -> (FlashFile, Sender<bool>, Receiver<Written>) {
        let ((go, wait), (put, taken)) = (channel(), channel());
        let writer = FlashWriter::new(move |offset, bytes: &[u8]| match wait.recv() {
            Ok(true) => put.send((offset, bytes.to_vec())).map_err(io::Error::other),
            _ => Err(io::ErrorKind::StorageFull.into()),
        });
        let flash = FlashFile { bytes: vec![0xFF; SECTORS * SECTOR], disk: FlashBacking::Background(writer.unwrap()) };
        (flash, go, taken)
    }

    /// A stalled disk delays nobody: written data can be read at once, and reach the disk in order later.
    #[test]
    fn no_write_waits_for_a_slow_disk() {
        let (flash, go, taken) = slow();
        let (mut flash, failure) = flash.in_background().unwrap();
        flash.erase(0, SECTOR as u32).unwrap();
        let places: Vec<u32> = (0..100).map(|place| 4 * ((7 * place) % 100)).collect();
        places.iter().for_each(|place| flash.write(*place, &[*place as u8; 4]).unwrap());
        // A write can only clear bits.
        flash.write(4, &[1; 4]).unwrap();
        let mut read = [0; 8];
        flash.read(4, &mut read).unwrap();
        assert_eq!(read, [0, 0, 0, 0, 8, 8, 8, 8]);
        assert!(taken.try_recv().is_err() && failure.take().is_none());
        (0..102).for_each(|_| go.send(true).unwrap());
        drop(flash);
        let all: Vec<(u32, Vec<u8>)> = taken.iter().collect();
        assert_eq!(all.iter().map(|(place, _)| *place).skip(1).collect::<Vec<_>>(), [places, vec![4]].concat());
        assert_eq!(all.last().unwrap().1, [0; 4]);
    }

    /// A failure is reported once, and nothing is written after it. A full queue is a failure, too.
    #[test]
    fn a_failure_is_told_once() {
        let (flash, go, taken) = slow();
        let (mut flash, failure) = flash.in_background().unwrap();
        go.send(false).unwrap();
        flash.write(0, &[1; 4]).unwrap();
        while !failure.lock().has_failed {
            thread::yield_now();
        }
        assert!(failure.take().is_some() && failure.take().is_none());
        assert!(flash.write(4, &[1; 4]).is_err() && taken.try_recv().is_err());

        let (mut flash, go, taken) = slow();
        let written = (0..2 * WAITING_MAX as u32).take_while(|_| flash.write(8, &[0; 4]).is_ok()).count();
        assert!((WAITING_MAX..WAITING_MAX + 2).contains(&written), "{written}");
        (0..written).for_each(|_| go.send(true).unwrap());
        assert!(taken.recv().is_ok() && flash.write(12, &[0; 4]).is_err());
    }
}

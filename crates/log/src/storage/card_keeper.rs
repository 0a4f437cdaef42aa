//! Keeps logs as files on a memory card.

use crate::storage::block::LogBlock;
use crate::storage::card::{CardError, LogCard};
use crate::storage::keeper::{LogKeeper, StorageState};
use crate::storage::query::{KeeperAnswer, LogPage, LogQuery};
use crate::storage::volume::{CardBlocks, NoClock};
use core::ops::ControlFlow;
use embedded_sdmmc::{DirEntry, Error, Mode, RawDirectory, RawFile, ShortFileName, VolumeIdx, VolumeManager};

/// Longest time until written data can be read back, even after a power cut \[us\].
const SYNC_US: u64 = 500_000;
/// Time between two attempts to start a card \[us\].
const RETRY_US: u64 = 1_000_000;
/// Prefix and extension of a log's file name.
const PREFIX: &[u8] = b"LOG";
const EXTENSION: &[u8] = b"ULG";
/// Fewest digits in a file name, and the largest log number that fits into a FAT file name.
const DIGITS: usize = 3;
const NUMBER_MAX: u32 = 99_999;

/// The volume manager, with room for two open files: one being written and one being read.
type Volumes<'a> = VolumeManager<CardBlocks<'a>, NoClock, 1, 2, 1>;

/// State of reading logs back.
#[derive(Debug, Default)]
pub(crate) struct Reader {
    /// Number of the first log that was missing or unfinished when the logs were counted last.
    pub(crate) bound: Option<u32>,
    /// Place in the list of logs and handle of the file that is open for reading.
    pub(crate) open: Option<(u16, RawFile)>,
}

impl Reader {
    /// Returns true while a file is open for reading.
    fn is_open(&self) -> bool {
        self.open.is_some()
    }
}

/// Keeps logs on a card.
pub struct CardKeeper<'a> {
    /// The volumes. None only while [`forget`](Self::forget) replaces them.
    pub(crate) volumes: Option<Volumes<'a>>,
    pub(crate) root: Option<RawDirectory>,
    pub(crate) file: Option<RawFile>,
    pub(crate) reader: Reader,
    pub(crate) state: StorageState,
    /// Number of the next log.
    pub(crate) next: u32,
    /// Time of the last call, and the time of the next attempt to start the card \[us\].
    pub(crate) now_us: u64,
    retry_us: u64,
    /// Time at which the file was last flushed, so that its data can be read back \[us\].
    synced_us: u64,
}

impl<'a> CardKeeper<'a> {
    /// Creates the keeper. The card's state is unknown until [`poll`](LogKeeper::poll).
    pub fn new(card: &'a mut dyn LogCard) -> Self {
        CardKeeper {
            volumes: Some(volumes(CardBlocks::new(card))),
            root: None,
            file: None,
            reader: Reader::default(),
            state: StorageState::Unknown,
            next: 1,
            now_us: 0,
            retry_us: 0,
            synced_us: 0,
        }
    }

    /// Writes the file's length to the card, if [`SYNC_US`] have passed since the last time.
    fn sync(&mut self, now_us: u64) {
        if self.file.is_some() && now_us.saturating_sub(self.synced_us) >= SYNC_US {
            self.synced_us = now_us;
            self.attempt(&mut |keeper| {
                let (volumes, file) = keeper.open()?;
                volumes.flush_file(file)
            });
        }
    }

    /// Closes the file being written.
    fn close(&mut self) {
        if self.file.is_some() {
            self.attempt(&mut |keeper| {
                let (volumes, file) = keeper.open()?;
                let closed = volumes.close_file(file);
                keeper.file = None;
                closed
            });
        }
    }

    /// Starts the card, and finds the number of the next log.
    fn start(&mut self) {
        let Some(volumes) = &self.volumes else { return };
        // A full card stays full as long as the same card is inserted.
        let started = volumes.device(|device| device.start());
        let was_full = self.state == StorageState::Full;
        self.state = match started {
            Ok(_) if was_full => StorageState::Full,
            Ok(true) => StorageState::Ready,
            Ok(false) => StorageState::Foreign,
            Err(CardError::Absent) => StorageState::Absent,
            Err(_) => StorageState::Failed,
        };
        match self.state {
            // Logs on a full card can still be read and erased.
            StorageState::Ready | StorageState::Full if self.root.is_none() => self.attempt(&mut Self::open_root),
            StorageState::Ready | StorageState::Full => (),
            _ => self.forget(),
        }
    }

    fn open_root(&mut self) -> Result<(), Error<CardError>> {
        let volumes = self.volumes.as_ref().ok_or(Error::BadHandle)?;
        let root = volumes.open_root_dir(volumes.open_raw_volume(VolumeIdx(0))?)?;
        self.root = Some(root);
        let mut last = 0;
        self.each_log(&mut |number, _| {
            last = number.max(last);
            ControlFlow::Continue(())
        })?;
        self.next = last.saturating_add(1);
        Ok(())
    }

    /// Calls `see` with each log's number and size. A directory with a log's name has no size.
    pub(crate) fn each_log(
        &self,
        see: &mut dyn FnMut(u32, Option<u32>) -> ControlFlow<()>,
    ) -> Result<(), Error<CardError>> {
        let (Some(volumes), Some(root)) = (&self.volumes, self.root) else { return Err(Error::BadHandle) };
        volumes.iterate_dir(root, |entry| match number(entry) {
            Some(number) => see(number, (!entry.attributes.is_directory()).then_some(entry.size)),
            None => ControlFlow::Continue(()),
        })
    }

    /// Creates the next log's file.
    fn create(&mut self) -> Result<(), Error<CardError>> {
        let (Some(volumes), Some(root)) = (&self.volumes, self.root) else { return Err(Error::BadHandle) };
        let name = log_name(self.next).ok_or(Error::DiskFull)?;
        self.file = Some(volumes.open_file_in_dir(root, name, Mode::ReadWriteCreate)?);
        self.next = self.next.saturating_add(1);
        Ok(())
    }

    fn open(&self) -> Result<(&Volumes<'a>, RawFile), Error<CardError>> {
        self.volumes.as_ref().zip(self.file).ok_or(Error::BadHandle)
    }

    /// Makes a call that needs the card. If the call fails, gives up the file and the volume.
    #[inline(never)]
    pub(crate) fn attempt(&mut self, call: &mut dyn FnMut(&mut Self) -> Result<(), Error<CardError>>) {
        if let Some(volumes) = &self.volumes {
            volumes.device(|device| device.begin());
        }
        let done = call(self);
        // `embedded-sdmmc` does not report every block that the card failed to deliver.
        let failure = self.volumes.as_ref().and_then(|volumes| volumes.device(|device| device.failure()));
        self.state = match (failure, done) {
            (None, Ok(())) => return,
            (Some(CardError::Absent), _) => StorageState::Absent,
            (Some(_), _) => StorageState::Failed,
            (None, Err(Error::DiskFull | Error::NotEnoughSpace)) => {
                // The part that fitted can still be read.
                self.end_full();
                StorageState::Full
            }
            (None, Err(_)) => StorageState::Foreign,
        };
        // The next attempt waits, so that the writer sees the failure and begins a new log.
        self.retry_us = self.now_us.saturating_add(RETRY_US);
        self.forget();
    }

    /// Closes everything without writing to the card.
    fn forget(&mut self) {
        (self.root, self.file, self.reader) = (None, None, Reader::default());
        let device = self.volumes.take().map(|volumes| volumes.free().0);
        self.volumes = device.map(volumes);
    }

    /// Closes the file on a full card.
    fn end_full(&mut self) {
        if let Ok((volumes, file)) = self.open() {
            volumes.device(|device| device.begin());
            let _ = volumes.close_file(file);
        }
    }
}

impl LogKeeper for CardKeeper<'_> {
    fn state(&self) -> StorageState {
        self.state
    }

    fn poll(&mut self, now_us: u64) {
        self.now_us = now_us;
        // A full card may have been exchanged.
        let is_waited_for = self.root.is_none() || self.state == StorageState::Full && !self.reader.is_open();
        if is_waited_for && now_us >= self.retry_us {
            self.retry_us = now_us.saturating_add(RETRY_US);
            self.start();
        }
        self.sync(now_us);
    }

    fn take(&mut self, now_us: u64, block: &LogBlock) {
        self.now_us = now_us;
        if block.begins() {
            // The previous log may have had no last block.
            self.close();
            self.synced_us = now_us;
            if self.state == StorageState::Ready {
                self.attempt(&mut Self::create);
            }
        }
        if self.file.is_some() {
            self.attempt(&mut |keeper| {
                let (volumes, file) = keeper.open()?;
                volumes.write(file, block.bytes())
            });
        }
        if block.ends() {
            self.close();
        }
        self.sync(now_us);
    }

    fn answer(&mut self, now_us: u64, query: LogQuery, page: &mut LogPage) {
        self.now_us = now_us;
        (page.query, page.answer) = (query, KeeperAnswer::Failed);
        if self.root.is_some() {
            self.attempt(&mut |keeper| {
                page.answer = keeper.look_up(query, &mut page.bytes)?;
                Ok(())
            });
        }
        // The call may have given up the volume although it returned an answer.
        if self.root.is_none() {
            page.answer = KeeperAnswer::Failed;
        }
    }
}

fn volumes(device: CardBlocks<'_>) -> Volumes<'_> {
    VolumeManager::new_with_limits(device, NoClock, 1)
}

/// Returns the file name of a log, such as `LOG001.ULG` for the first. Returns none if the number does not fit into a
/// FAT name.
#[inline(never)]
pub fn log_name(number: u32) -> Option<ShortFileName> {
    if number > NUMBER_MAX {
        return None;
    }
    let mut name = *b"LOG00000.ULG";
    let mut left = number;
    for place in name.get_mut(PREFIX.len()..PREFIX.len() + 5)?.iter_mut().rev() {
        *place = b'0' + (left % 10) as u8;
        left /= 10;
    }
    let unneeded = match number {
        0..=999 => 2,
        1_000..=9_999 => 1,
        _ => 0,
    };
    name.get_mut(PREFIX.len()..)?.rotate_left(unneeded);
    let name = name.get(..name.len() - unneeded)?;
    ShortFileName::create_from_str(core::str::from_utf8(name).ok()?).ok()
}

/// Returns the number of a log's file, or none for any other entry.
fn number(entry: &DirEntry) -> Option<u32> {
    let digits = entry.name.base_name().strip_prefix(PREFIX)?;
    // A number of more than three digits has no leading zero.
    let is_longer = digits.len() > DIGITS && digits.first() == Some(&b'0');
    if entry.name.extension() != EXTENSION || digits.len() < DIGITS || is_longer {
        return None;
    }
    digits.iter().try_fold(0_u32, |number, digit| match digit {
        b'0'..=b'9' => number.checked_mul(10)?.checked_add(u32::from(digit - b'0')),
        _ => None,
    })
}

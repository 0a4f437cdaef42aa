//! Simulates a logging vehicle: its block queue, a task that waits for its storage, and a card in memory.
#![allow(dead_code, reason = "shared by tests")]

pub(crate) mod chip;
pub(crate) mod station;
pub(crate) mod ulog;

use afbc_estimator::Measurement;
use afbc_log::storage::embedded_sdmmc::Block;
use afbc_log::storage::{
    BlockSink, CardError, CardKeeper, KeptLogs, LogBlock, LogCard, LogKeeper, LogMode, LogPage, LogPages, LogQuery,
    LogWriter, StorageState,
};
use afbc_log::ulog::{BesideTick, LogStart};
use afbc_onboard::parameters::{ParameterTable, RecordChange};
use afbc_onboard::{Aged, Configuration, ControlInputs, Flight, Readings, TickInputs, TickRecord};
use afbc_store::RecordName;
use nalgebra::Vector3;
use std::cell::RefCell;
use std::collections::VecDeque;
use std::io::{Cursor, Read, Seek, SeekFrom, Write};
use std::rc::Rc;
use std::sync::{Arc, Mutex};

/// Time between two ticks \[us\].
pub(crate) const TICK_US: u64 = 1_000;
/// First block of the volume.
pub(crate) const VOLUME: usize = 63;
/// Number of blocks in the queue.
const QUEUE: usize = 20;

/// Content and behaviour of a card.
pub(crate) struct Disk {
    pub(crate) bytes: Vec<u8>,
    /// Each written block with its time \[us\] and number, in order.
    pub(crate) written: Vec<(u64, u32, [u8; 512])>,
    pub(crate) is_there: bool,
    /// Number of calls until one fails; none if no call fails.
    pub(crate) fails_in: Option<u32>,
    /// Returns the duration of a call \[us\].
    pub(crate) takes_us: Box<dyn FnMut() -> u64 + Send>,
    /// Total duration of the calls since the last [`Storage::begin`] \[us\].
    pub(crate) taken_us: u64,
    pub(crate) now_us: u64,
    pub(crate) calls: u64,
}

#[derive(Clone)]
pub(crate) struct Card(pub(crate) Arc<Mutex<Disk>>);

impl Disk {
    /// Makes one call. Returns the bytes of this block, unless the call fails.
    fn call(&mut self, number: u32) -> Result<&mut [u8], CardError> {
        self.calls += 1;
        self.taken_us += (self.takes_us)();
        if !self.is_there {
            return Err(CardError::Absent);
        }
        match &mut self.fails_in {
            Some(0) => {
                self.fails_in = None;
                return Err(CardError::Failed);
            }
            Some(left) => *left -= 1,
            None => (),
        }
        let start = number as usize * 512;
        self.bytes.get_mut(start..start + 512).ok_or(CardError::Failed)
    }
}

impl LogCard for Card {
    fn start(&mut self) -> Result<u32, CardError> {
        let mut disk = self.0.lock().unwrap();
        disk.call(0)?;
        Ok((disk.bytes.len() / 512) as u32)
    }

    fn read(&mut self, number: u32, block: &mut Block) -> Result<(), CardError> {
        block.contents.copy_from_slice(self.0.lock().unwrap().call(number)?);
        Ok(())
    }

    fn write(&mut self, number: u32, block: &Block) -> Result<(), CardError> {
        let mut disk = self.0.lock().unwrap();
        disk.call(number)?.copy_from_slice(&block.contents);
        let at_us = disk.now_us + disk.taken_us;
        disk.written.push((at_us, number, block.contents));
        Ok(())
    }
}

/// The volume on a disk, as the other FAT library accesses it.
pub(crate) struct Partition<'a>(Cursor<&'a mut [u8]>);

impl Read for Partition<'_> {
    fn read(&mut self, into: &mut [u8]) -> std::io::Result<usize> {
        self.0.read(into)
    }
}

impl Write for Partition<'_> {
    fn write(&mut self, from: &[u8]) -> std::io::Result<usize> {
        self.0.write(from)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl Seek for Partition<'_> {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        self.0.seek(to)
    }
}

pub(crate) type OtherFat<'a> = fatfs::FileSystem<Partition<'a>>;

/// Mounts the volume with a FAT library that the logger does not use.
pub(crate) fn mount(disk: &mut [u8]) -> OtherFat<'_> {
    let options = fatfs::FsOptions::new().update_accessed_date(false);
    fatfs::FileSystem::new(Partition(Cursor::new(&mut disk[VOLUME * 512..])), options).unwrap()
}

/// Returns the logs on a disk, sorted by name.
pub(crate) fn logs(disk: &mut [u8]) -> Vec<(String, Vec<u8>)> {
    let volume = mount(disk);
    let mut logs: Vec<_> = volume
        .root_dir()
        .iter()
        .map(|entry| entry.unwrap())
        .filter(|entry| entry.file_name().starts_with("LOG") && entry.is_file())
        .map(|entry| {
            let mut bytes = Vec::new();
            entry.to_file().read_to_end(&mut bytes).unwrap();
            assert_eq!(bytes.len() as u64, entry.len(), "{}: its clusters end too early", entry.file_name());
            (entry.file_name(), bytes)
        })
        .collect();
    logs.sort();
    logs
}

/// Returns a card with an empty volume of this many blocks.
pub(crate) fn card(fat: fatfs::FatType, blocks: usize) -> Card {
    let mut bytes = vec![0; (VOLUME + blocks) * 512];
    let kind = if fat == fatfs::FatType::Fat32 { 0x0C } else { 0x06 };
    bytes[450] = kind;
    bytes[454..458].copy_from_slice(&(VOLUME as u32).to_le_bytes());
    bytes[458..462].copy_from_slice(&(blocks as u32).to_le_bytes());
    bytes[510..512].copy_from_slice(&[0x55, 0xAA]);
    let options = fatfs::FormatVolumeOptions::new().fat_type(fat);
    let options = if fat == fatfs::FatType::Fat32 { options.bytes_per_cluster(512) } else { options };
    fatfs::format_volume(Partition(Cursor::new(&mut bytes[VOLUME * 512..])), options).unwrap();
    Card(Arc::new(Mutex::new(Disk {
        bytes,
        written: Vec::new(),
        is_there: true,
        fails_in: None,
        takes_us: Box::new(|| 300),
        taken_us: 0,
        now_us: 0,
        calls: 0,
    })))
}

pub(crate) fn fat16() -> Card {
    card(fatfs::FatType::Fat16, 20_000)
}

pub(crate) fn fat32() -> Card {
    card(fatfs::FatType::Fat32, 68_000)
}

/// The queue of blocks between the tasks.
#[derive(Default)]
struct Queue {
    filled: VecDeque<LogBlock>,
    next: LogBlock,
}

impl BlockSink for Queue {
    fn free(&mut self) -> Option<&mut LogBlock> {
        (self.filled.len() < QUEUE).then_some(&mut self.next)
    }

    fn done(&mut self) {
        self.filled.push_back(self.next.clone());
    }
}

/// The page between the tasks, and the query.
struct Between {
    page: LogPage,
    is_full: bool,
    asked: LogQuery,
}

/// The page and the query, as the links' task accesses them.
pub(crate) struct Pages {
    between: Rc<RefCell<Between>>,
    page: LogPage,
}

impl LogPages for Pages {
    fn page(&mut self) -> Option<&LogPage> {
        let between = self.between.borrow();
        if between.is_full {
            self.page = between.page.clone();
        }
        between.is_full.then_some(&self.page)
    }

    fn done(&mut self) {
        self.between.borrow_mut().is_full = false;
    }

    fn ask(&mut self, query: LogQuery) {
        self.between.borrow_mut().asked = query;
    }
}

/// A storage for logs, with its own simulated time.
pub(crate) trait Storage: Clone {
    type Keeper: LogKeeper;
    /// True if the storage holds small logs.
    const SMALL: bool;

    fn keeper(&self) -> Self::Keeper;

    /// Begins a call at this time.
    fn begin(&self, now_us: u64);

    /// Returns the duration of the call \[us\].
    fn taken_us(&self) -> u64;

    /// Returns the logs by name, read independently of the logger.
    fn logs(&self) -> Vec<(String, Vec<u8>)>;
}

impl Storage for Card {
    type Keeper = CardKeeper<'static>;
    const SMALL: bool = false;

    fn keeper(&self) -> CardKeeper<'static> {
        CardKeeper::new(Box::leak(Box::new(self.clone())))
    }

    fn begin(&self, now_us: u64) {
        let mut disk = self.0.lock().unwrap();
        (disk.now_us, disk.taken_us) = (now_us, 0);
    }

    fn taken_us(&self) -> u64 {
        self.0.lock().unwrap().taken_us
    }

    fn logs(&self) -> Vec<(String, Vec<u8>)> {
        logs(&mut self.0.lock().unwrap().bytes)
    }
}

/// A vehicle that logs.
pub(crate) struct Room<S: Storage = Card> {
    between: Rc<RefCell<Between>>,
    pub(crate) stored: KeptLogs<Pages>,

    pub(crate) card: S,
    pub(crate) keeper: S::Keeper,
    pub(crate) writer: LogWriter,
    queue: Queue,
    flight: Flight,
    table: ParameterTable,
    pub(crate) now_us: u64,
    /// Time up to which the log's task waits for the storage \[us\].
    busy_us: u64,
    /// State of the storage that the writer sees.
    pub(crate) state: StorageState,
    pub(crate) mode: LogMode,
    pub(crate) armed: bool,
    pub(crate) told: Vec<&'static str>,
    /// Number of ticks that were to be logged.
    pub(crate) wanted: u64,
}

impl<S: Storage> Room<S> {
    pub(crate) fn new(card: &S) -> Self {
        let configuration = Configuration::default();
        let keeper = card.keeper();
        let between = Between { page: LogPage::EMPTY, is_full: false, asked: LogQuery::Nothing };
        let between = Rc::new(RefCell::new(between));
        let stored = KeptLogs::new(Pages { between: between.clone(), page: LogPage::EMPTY });
        Room {
            between,
            stored,
            card: card.clone(),
            keeper,
            writer: LogWriter::new(S::SMALL),
            queue: Queue::default(),
            flight: Flight::new(&configuration).unwrap(),
            table: ParameterTable::new(configuration),
            now_us: 0,
            busy_us: 0,
            state: StorageState::Unknown,
            mode: LogMode::Boot,
            armed: false,
            told: Vec::new(),
            wanted: 0,
        }
    }

    /// Runs a tick. If `misses` is true, the writer does not see it.
    pub(crate) fn tick(&mut self, misses: bool) {
        self.now_us += TICK_US;
        let now_us = self.now_us;
        let noise = 1e-3 * (now_us / TICK_US % 7) as f32;
        let imu = Some(Aged { value: [Vector3::new(0.0, noise, 0.0), Vector3::new(noise, 0.0, 9.81)], age_us: 0 });
        let aid = Aged { value: Measurement::Height { height_m: 1.5, sigma_m: 0.5 }, age_us: 300 };
        let readings = Readings { imu, aids: [now_us.is_multiple_of(20_000).then_some(aid), None] };
        let (mut messages, inputs) =
            (ControlInputs::EMPTY, TickInputs { time_us: now_us, readings, ..TickInputs::default() });
        let before = self.flight.before(&messages);
        let report = self.flight.tick(inputs.time_us, &mut messages, &readings);
        let details = self.flight.details(&inputs, &before, &messages);
        let tick = TickRecord { report: &report, details: &details };
        let start = LogStart { vehicle: "paper", law: "afbc", hardware: "test", ..LogStart::default() };
        let Room { writer, table, state, queue, .. } = self;
        if writer.wants(now_us, self.armed, self.mode) {
            self.wanted += 1;
            if !misses {
                writer.tick((&tick, &BesideTick::default()), table, &start, *state, TICK_US);
            }
        }
        if let Some((text, is_warning)) = writer.news(*state) {
            writer.text(now_us, if is_warning { 4 } else { 6 }, text);
            self.told.push(text);
        }
        writer.send(queue, *state);
        self.task();
    }

    /// Runs the log's task for this millisecond, unless it still waits for the storage.
    fn task(&mut self) {
        while self.busy_us <= self.now_us {
            // The task acts on the state that it found before it waited.
            self.state = self.keeper.state();
            let began_us = self.busy_us.max(self.now_us - TICK_US);
            self.card.begin(began_us);
            match self.queue.filled.pop_front() {
                Some(block) => self.keeper.take(began_us, &block),
                None => self.keeper.poll(began_us),
            }
            {
                let mut between = self.between.borrow_mut();
                let is_free = !between.is_full && self.queue.filled.is_empty();
                if between.asked != LogQuery::Nothing && is_free {
                    let query = std::mem::take(&mut between.asked);
                    self.keeper.answer(began_us, query, &mut between.page);
                    between.is_full = true;
                }
            }
            let took_us = self.card.taken_us();
            // Without a block, the task runs again in the next tick.
            self.busy_us = if took_us == 0 { self.now_us + 1 } else { began_us + took_us };
            if took_us == 0 && !self.queue.filled.is_empty() {
                self.busy_us = began_us;
            }
        }
        self.state = if self.busy_us <= self.now_us + 1 { self.keeper.state() } else { self.state };
    }

    pub(crate) fn run(&mut self, ticks: u64) {
        (0..ticks).for_each(|_| self.tick(false));
    }

    pub(crate) fn change(&mut self, value: f32) {
        let name = RecordName::new("EST_GATE").unwrap();
        let value = self.table.set(name, value).unwrap().value;
        self.writer.change(&self.table, RecordChange::Set(name, Some(value)));
    }

    pub(crate) fn logs(&self) -> Vec<(String, Vec<u8>)> {
        self.card.logs()
    }
}

/// Checks that dropouts match the missing samples, to one tick each. Returns the times of the first and last sample
/// \[us\].
pub(crate) fn adds_up(log: &ulog::ReadLog) -> Option<[u64; 2]> {
    let times = &log.samples_us;
    let ends = [*times.first()?, *times.last()?];
    // Dropouts before the first sample fall into the log's beginning.
    let mut dropouts = log.dropouts.iter().filter(|(_, before)| *before > 0).peekable();
    let (mut missing_ms, mut told_ms, mut number) = (0, 0, 1);
    for (index, pair) in times.windows(2).enumerate() {
        let mut is_told = false;
        while let Some((ms, _)) = dropouts.next_if(|(_, before)| *before <= index + 1) {
            (told_ms, number, is_told) = (told_ms + ms, number + 1, true);
        }
        let gap_us = pair[1] - pair[0];
        assert!(gap_us == TICK_US || is_told, "a gap of {gap_us} us without a dropout");
        missing_ms += gap_us / TICK_US - 1;
    }
    // The sample of the tick in which a dropout begins may exist.
    assert!((missing_ms..=missing_ms + number).contains(&told_ms), "{missing_ms} ms are missing, {told_ms} ms told");
    Some(ends)
}

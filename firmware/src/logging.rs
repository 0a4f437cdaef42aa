//! The black box: ticks to blocks, in the links' task, and blocks to a memory card or flash, in a task below all
//! others, which may wait for it. See [`afbc_log::storage`].

use crate::aux_sensors;
use crate::board::Board;
use crate::vehicle::{NAME, ParameterTable, ROTORS};
use afbc_log::storage::{
    BlockSink, KeptLogs, LogBlock, LogKeeper, LogPage, LogPages, LogQuery, LogWriter, StorageState,
};
use afbc_log::ulog::{BesideTick, LogStart};
use afbc_onboard::parameters::RecordChange;
use afbc_onboard::{EscTelemetry, TickRecord};
use afbc_station::{Comms, LogServer, REPORT_MAX};
use core::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use embassy_futures::select::{Either3, select3};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_sync::zerocopy_channel::{Channel, Receiver, Sender};
use embassy_time::{Instant, Timer};
use heapless::Vec;
use static_cell::StaticCell;

/// Blocks that wait, at most: of a log of 140 kB/s those of 43 ms.
const BLOCKS: usize = 12;
/// Time between two looks at a storage without a log \[us\].
const LOOK_US: u64 = 100_000;
/// The control period \[us\].
const PERIOD_US: u64 = 1_000;
/// The law that every image flies: AFBC under its monitor.
const LAW: &str = "afbc";

/// Of a board that keeps no logs.
pub struct NoLog;

impl LogKeeper for NoLog {
    fn state(&self) -> StorageState {
        StorageState::Absent
    }

    fn poll(&mut self, _: u64) {}

    fn take(&mut self, _: u64, _: &LogBlock) {}

    fn answer(&mut self, _: u64, _: LogQuery, _: &mut LogPage) {}
}

type Blocks = Channel<'static, CriticalSectionRawMutex, LogBlock>;

/// What the log's task has of the links': blocks to be kept, and where it puts what is asked of the logs.
pub struct LogEnds {
    blocks: Receiver<'static, CriticalSectionRawMutex, LogBlock>,
    pages: Sender<'static, CriticalSectionRawMutex, LogPage>,
}

static WANTED: AtomicBool = AtomicBool::new(false);
static STORAGE: AtomicU8 = AtomicU8::new(StorageState::Unknown as u8);
/// What is asked of the logs that are kept.
static ASKED: Signal<CriticalSectionRawMutex, LogQuery> = Signal::new();

/// True if there is a log to be written.
pub(crate) fn is_wanted() -> bool {
    WANTED.load(Ordering::Relaxed)
}

fn storage() -> StorageState {
    StorageState::of(STORAGE.load(Ordering::Relaxed))
}

struct Queue(Sender<'static, CriticalSectionRawMutex, LogBlock>);

impl BlockSink for Queue {
    fn free(&mut self) -> Option<&mut LogBlock> {
        self.0.try_send()
    }

    fn done(&mut self) {
        self.0.send_done();
    }
}

struct Pages(Receiver<'static, CriticalSectionRawMutex, LogPage>);

impl LogPages for Pages {
    fn page(&mut self) -> Option<&LogPage> {
        self.0.try_receive().map(|page| &*page)
    }

    fn done(&mut self) {
        self.0.receive_done();
    }

    fn ask(&mut self, query: LogQuery) {
        ASKED.signal(query);
    }
}

/// The links' task's part.
pub struct LinkLog {
    /// What stations ask of the logs.
    pub(crate) server: LogServer,
    stored: KeptLogs<Pages>,
    writer: LogWriter,
    queue: Queue,
    hardware: &'static str,
}

impl LinkLog {
    /// Creates it, before the first tick, and what the log's task receives; to be called once.
    #[inline(never)]
    pub(crate) fn begin<B: Board>() -> (&'static mut Self, LogEnds) {
        static LOG: StaticCell<LinkLog> = StaticCell::new();
        static BLOCKS_HELD: StaticCell<[LogBlock; BLOCKS]> = StaticCell::new();
        static BLOCK_CHANNEL: StaticCell<Blocks> = StaticCell::new();
        static PAGE: StaticCell<[LogPage; 1]> = StaticCell::new();
        static PAGE_CHANNEL: StaticCell<Channel<'static, CriticalSectionRawMutex, LogPage>> = StaticCell::new();
        let blocks = BLOCKS_HELD.init_with(|| [const { LogBlock::EMPTY }; BLOCKS]);
        let (pages, page) = PAGE_CHANNEL.init_with(|| Channel::new(PAGE.init_with(|| [LogPage::EMPTY]))).split();
        let (queue, blocks) = BLOCK_CHANNEL.init_with(|| Channel::new(blocks)).split();
        let log = LOG.init_with(|| LinkLog {
            server: LogServer::default(),
            stored: KeptLogs::new(Pages(page)),
            writer: LogWriter::new(B::SMALL_LOGS),
            queue: Queue(queue),
            hardware: B::HARDWARE,
        });
        (log, LogEnds { blocks, pages })
    }

    /// Begins a tick of the links' task, of which this is the newest report. Returns a text for stations about the
    /// storage when there is something new, and whether it is a warning.
    pub(crate) fn begin_tick(
        &mut self,
        now_us: u64,
        armed: bool,
        table: &ParameterTable,
    ) -> Option<(&'static str, bool)> {
        let wanted = self.writer.wants(now_us, armed, table.configuration().link.log_mode);
        // Without a storage that takes it, the ticks are not even passed on.
        WANTED.store(wanted && storage() == StorageState::Ready, Ordering::Relaxed);
        self.writer.news(storage())
    }

    /// Writes a tick.
    #[inline(never)]
    pub(crate) fn tick(&mut self, tick: &TickRecord<'_, ROTORS>, table: &ParameterTable, escs: &EscTelemetry) {
        let beside = BesideTick { escs: Some(escs), origin: aux_sensors::frame_origin() };
        let start = LogStart { vehicle: NAME, law: LAW, hardware: self.hardware, ..LogStart::default() };
        self.writer.tick((tick, &beside), table, &start, storage(), PERIOD_US);
    }

    /// Writes a change of the parameters.
    pub(crate) fn change(&mut self, table: &ParameterTable, change: RecordChange) {
        self.writer.change(table, change);
    }

    /// Goes on with what stations ask of the logs.
    #[inline(never)]
    pub(crate) fn transfer(&mut self, comms: &mut Comms, outgoing: &mut Vec<u8, REPORT_MAX>) {
        if self.server.is_busy() {
            // There is room.
            let send = &mut |frame: &[u8]| drop(outgoing.extend_from_slice(frame));
            comms.transfer_logs(&mut self.server, &mut self.stored, send);
        }
    }

    /// Writes the texts among the messages of a tick, and passes full blocks on.
    #[inline(never)]
    pub(crate) fn send(&mut self, now_us: u64, messages: &[u8]) {
        let LinkLog { writer, queue, .. } = self;
        for (severity, text) in afbc_link::sent_texts(messages) {
            writer.text(now_us, severity, text);
        }
        writer.send(queue, storage());
    }
}

/// Keeps logs, for ever. Calls of the keeper wait for its card or flash: nothing else may be on this executor.
pub async fn run(LogEnds { mut blocks, mut pages }: LogEnds, keeper: &mut dyn LogKeeper) -> ! {
    let mut asked = LogQuery::Nothing;
    loop {
        let look = Timer::at(Instant::from_micros(Instant::now().as_micros().wrapping_add(LOOK_US)));
        // Blocks come first.
        let is_block = match select3(blocks.receive(), ASKED.wait(), look).await {
            Either3::First(block) => {
                keeper.take(Instant::now().as_micros(), block);
                true
            }
            Either3::Second(query) => {
                asked = query;
                false
            }
            Either3::Third(()) => {
                keeper.poll(Instant::now().as_micros());
                false
            }
        };
        if is_block {
            blocks.receive_done();
        }
        // The log that is written has the right of way. The page may still be with the links' task.
        if asked != LogQuery::Nothing
            && blocks.try_receive().is_none()
            && let Some(page) = pages.try_send()
        {
            keeper.answer(Instant::now().as_micros(), core::mem::take(&mut asked), page);
            pages.send_done();
        }
        STORAGE.store(keeper.state() as u8, Ordering::Relaxed);
    }
}

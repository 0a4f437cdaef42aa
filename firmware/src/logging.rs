//! Black box ([`afbc_log::storage`]). The link task packs ticks into blocks. The logging task writes the blocks to a
//! memory card or flash. It has the lowest priority, since it may wait for the storage.

use crate::aux_sensors;
use crate::board::Board;
use crate::vehicle::NAME;
use afbc_comms::{Comms, LogServer, REPORT_MAX};
use afbc_log::storage::{
    BlockSink, KeptLogs, LogBlock, LogKeeper, LogPage, LogPages, LogQuery, LogWriter, StorageState,
};
use afbc_log::ulog::{BesideTick, LogStart};
use afbc_onboard::parameters::{ParameterTable, RecordChange};
use afbc_onboard::{EscTelemetry, TickRecord};
use core::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use embassy_futures::select::{Either3, select3};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_sync::zerocopy_channel::{Channel, Receiver, Sender};
use embassy_time::{Instant, Timer};
use heapless::Vec;
use static_cell::StaticCell;

/// Number of blocks that can wait: 43 ms of a log of 140 kB/s.
const BLOCKS: usize = 12;
/// Time between two polls of the storage while there is nothing to write \[us\].
const LOOK_US: u64 = 100_000;
/// Control period \[us\].
const PERIOD_US: u64 = 1_000;
/// Name of the law that every image flies: AFBC under its monitor.
const LAW: &str = "afbc";

/// Storage of a board that keeps no logs.
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

/// Logging task's ends of the channels to the link task: blocks to write, and pages of stored logs that stations asked
/// for.
pub struct LogEnds {
    blocks: Receiver<'static, CriticalSectionRawMutex, LogBlock>,
    pages: Sender<'static, CriticalSectionRawMutex, LogPage>,
}

static WANTED: AtomicBool = AtomicBool::new(false);
static STORAGE: AtomicU8 = AtomicU8::new(StorageState::Unknown as u8);
/// Newest query about the stored logs.
static ASKED: Signal<CriticalSectionRawMutex, LogQuery> = Signal::new();

/// True if ticks are to be logged.
pub(crate) fn is_wanted() -> bool {
    WANTED.load(Ordering::Relaxed)
}

fn storage() -> StorageState {
    StorageState::of(STORAGE.load(Ordering::Relaxed))
}

struct BlockQueue(Sender<'static, CriticalSectionRawMutex, LogBlock>);

impl BlockSink for BlockQueue {
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

/// Link task's part of the black box.
pub struct LinkLog {
    /// Answers to stations' requests for stored logs.
    pub(crate) server: LogServer,
    stored: KeptLogs<Pages>,
    writer: LogWriter,
    queue: BlockQueue,
    hardware: &'static str,
}

impl LinkLog {
    /// Creates the link task's part and the logging task's ends, before the first tick. Must be called once.
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
            queue: BlockQueue(queue),
            hardware: B::HARDWARE,
        });
        (log, LogEnds { blocks, pages })
    }

    /// Begins a tick of the log. Returns a text for stations, and whether it is a warning, when the state of the
    /// storage has changed.
    pub(crate) fn begin_tick(
        &mut self,
        now_us: u64,
        armed: bool,
        table: &ParameterTable,
    ) -> Option<(&'static str, bool)> {
        let wanted = self.writer.wants(now_us, armed, table.configuration().link.log_mode);
        // Details of ticks are not even passed on unless the storage is ready.
        WANTED.store(wanted && storage() == StorageState::Ready, Ordering::Relaxed);
        self.writer.news(storage())
    }

    /// Logs a tick.
    #[inline(never)]
    pub(crate) fn tick(&mut self, tick: &TickRecord<'_>, table: &ParameterTable, escs: &EscTelemetry) {
        let beside = BesideTick { escs: Some(escs), origin: aux_sensors::frame_origin() };
        let start = LogStart { vehicle: NAME, law: LAW, hardware: self.hardware, ..LogStart::default() };
        self.writer.tick((tick, &beside), table, &start, storage(), PERIOD_US);
    }

    /// Logs a change of the parameters.
    pub(crate) fn change(&mut self, table: &ParameterTable, change: RecordChange) {
        self.writer.change(table, change);
    }

    /// Continues answering stations' requests for stored logs.
    #[inline(never)]
    pub(crate) fn transfer(&mut self, comms: &mut Comms, outgoing: &mut Vec<u8, REPORT_MAX>) {
        if self.server.is_busy() {
            let send = &mut |frame: &[u8]| drop(outgoing.extend_from_slice(frame));
            comms.transfer_logs(&mut self.server, &mut self.stored, send);
        }
    }

    /// Logs the status texts among the messages of a tick, and passes full blocks on.
    #[inline(never)]
    pub(crate) fn send(&mut self, now_us: u64, messages: &[u8]) {
        let LinkLog { writer, queue, .. } = self;
        for (severity, text) in afbc_mavlink::sent_texts(messages) {
            writer.text(now_us, severity, text);
        }
        writer.send(queue, storage());
    }
}

/// Runs the logging task. Calls of `keeper` block on its card or flash, so no other task may be on this executor.
pub async fn run(LogEnds { mut blocks, mut pages }: LogEnds, keeper: &mut dyn LogKeeper) -> ! {
    let mut asked = LogQuery::Nothing;
    loop {
        let look = Timer::at(Instant::from_micros(Instant::now().as_micros().wrapping_add(LOOK_US)));
        // New blocks have precedence over queries.
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
        // Waiting blocks are written before a query is answered. The link task may still be using the page.
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

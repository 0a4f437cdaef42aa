//! The exact log ([`afbc_log::exact`]) on one of the links.

use crate::board::{Board, Links, Transmitter};
use crate::samples::Sampler;
use crate::ticks::Tick;
use crate::vehicle::NAME;
use afbc_log::exact::RecordQueue;
use afbc_onboard::parameters::{ParameterTable, RecordChange};
use afbc_onboard::{ControlInputs, TickRecord};
use core::sync::atomic::{AtomicBool, Ordering};
use static_cell::StaticCell;

static RECORDS: AtomicBool = AtomicBool::new(false);

/// True while the exact log is being written.
pub fn records() -> bool {
    RECORDS.load(Ordering::Relaxed)
}

/// True if the board may keep an exact log: it has sensors and a spare link. Other images leave the code out.
pub const fn is_possible<B: Board>() -> bool {
    B::Sampler::SENSES && B::Links::COUNT > 1
}

/// Name of the law that every image flies: AFBC under its monitor.
const LAW: &str = "afbc";

/// Exact log and the link that carries it.
pub struct ExactLog {
    queue: RecordQueue,
    /// Index of the link that carries the log.
    link: usize,
}

impl ExactLog {
    /// Begins the log before the first tick, if the parameters ask for one. Must be called once.
    #[inline(never)]
    pub fn begin<B: Board>(table: &ParameterTable) -> Option<&'static mut Self> {
        static LOG: StaticCell<ExactLog> = StaticCell::new();
        let link = usize::try_from(table.configuration().link.log_port).ok()?.checked_sub(1)?;
        // The log replaces MAVLink on its link, and the first link is reserved for stations.
        if !is_possible::<B>() || link == 0 || link >= B::Links::COUNT {
            return None;
        }
        let log = LOG.init_with(|| ExactLog { queue: RecordQueue::default(), link });
        log.start(table);
        Some(log)
    }

    // This function is not generic, since code generic in the board is compiled in the board's crate and optimized for
    // speed.
    #[inline(never)]
    fn start(&mut self, table: &ParameterTable) {
        self.queue.start([NAME, LAW], table);
        RECORDS.store(true, Ordering::Relaxed);
    }

    /// Records the inputs that messages brought for the tick of this number.
    #[inline(never)]
    pub fn inputs(&mut self, tick: u32, inputs: &ControlInputs) {
        self.queue.inputs(tick, inputs);
    }

    /// Records a change of the parameters, and returns the number of the new configuration.
    #[inline(never)]
    pub fn change(&mut self, table: &ParameterTable, change: RecordChange) -> u16 {
        self.queue.change(table, change)
    }

    /// Records a tick.
    #[inline(never)]
    pub fn tick(&mut self, tick: &TickRecord<'_>) {
        self.queue.tick(tick);
    }

    /// Sends recorded data, as far as the link has room.
    #[inline(never)]
    pub fn send(&mut self, tick: &Tick, links: &mut impl Links) {
        let ExactLog { queue, link } = self;
        if let Some(link) = links.each().get_mut(*link) {
            queue.send(&mut |frame| link.transmitter.transmit(tick, frame));
        }
    }

    /// Returns the index of the link that carries the log.
    pub fn link(&self) -> usize {
        self.link
    }
}

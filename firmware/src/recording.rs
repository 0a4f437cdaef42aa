//! The exact log ([`afbc_log::exact`]) on one of the links.

use crate::board::{Board, Links, Transmitter};
use crate::samples::Sampler;
use crate::ticks::Tick;
use crate::vehicle::{NAME, ParameterTable, ROTORS};
use afbc_log::exact::RecordQueue;
use afbc_onboard::parameters::RecordChange;
use afbc_onboard::{ControlInputs, TickRecord};
use core::sync::atomic::{AtomicBool, Ordering};
use static_cell::StaticCell;

static RECORDS: AtomicBool = AtomicBool::new(false);

/// True if the exact log is written.
pub fn records() -> bool {
    RECORDS.load(Ordering::Relaxed)
}

/// True if a board may keep an exact log: it has sensors, and a link to spare. Others have none of it.
pub const fn is_possible<B: Board>() -> bool {
    B::Sampler::SENSES && B::Links::COUNT > 1
}

/// The law that every image flies: AFBC under its monitor.
const LAW: &str = "afbc";

/// The exact log on one of the links.
pub struct ExactLog {
    queue: RecordQueue,
    /// Index of the link.
    link: usize,
}

impl ExactLog {
    /// Begins the log, before the first tick, if the parameters want one; to be called once.
    #[inline(never)]
    pub fn begin<B: Board>(table: &ParameterTable) -> Option<&'static mut Self> {
        static LOG: StaticCell<ExactLog> = StaticCell::new();
        let link = usize::try_from(table.configuration().link.log_port).ok()?.checked_sub(1)?;
        // The log takes MAVLink's place on its link: the first one stays for stations.
        if !is_possible::<B>() || link == 0 || link >= B::Links::COUNT {
            return None;
        }
        let log = LOG.init_with(|| ExactLog { queue: RecordQueue::default(), link });
        log.start(table);
        Some(log)
    }

    // Not for each board anew: what only depends on it is compiled to be fast.
    #[inline(never)]
    fn start(&mut self, table: &ParameterTable) {
        self.queue.start([NAME, LAW], table);
        RECORDS.store(true, Ordering::Relaxed);
    }

    /// Records what messages have brought for the tick of this number.
    #[inline(never)]
    pub fn inputs(&mut self, tick: u32, inputs: &ControlInputs) {
        self.queue.inputs(tick, inputs);
    }

    /// Records a change of the parameters, and returns the number of the configuration.
    #[inline(never)]
    pub fn change(&mut self, table: &ParameterTable, change: RecordChange) -> u16 {
        self.queue.change(table, change)
    }

    /// Records a tick.
    #[inline(never)]
    pub fn tick(&mut self, tick: &TickRecord<'_, ROTORS>) {
        self.queue.tick(tick);
    }

    /// Sends what is recorded, as far as the link takes it.
    #[inline(never)]
    pub fn send(&mut self, tick: &Tick, links: &mut impl Links) {
        let ExactLog { queue, link } = self;
        if let Some(link) = links.each().get_mut(*link) {
            queue.send(&mut |frame| link.transmitter.transmit(tick, frame));
        }
    }

    /// Index of the link that carries it.
    pub fn link(&self) -> usize {
        self.link
    }
}

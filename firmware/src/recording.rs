//! What ticks took and gave, from the control task to the links' task, for the exact log ([`afbc_log::exact`]) and the
//! black box ([`crate::logging`]). Nothing is kept unless one of them is written.

use crate::board::{Board, Links, Transmitter};
use crate::samples::Sampler;
use crate::ticks::Tick;
use crate::vehicle::{NAME, ParameterTable, Report};
use afbc_guidance::BatteryReading;
use afbc_log::exact::{Given, RecordQueue, TickRecord};
use afbc_onboard::parameters::RecordChange;
use afbc_onboard::{ControlInputs, Readings};
use core::cell::RefCell;
use core::sync::atomic::{AtomicBool, Ordering};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use heapless::Deque;
use static_cell::StaticCell;

/// Ticks that wait, at most; further ones are missing in the log.
const WAITING: usize = 8;

/// A tick for the log.
#[derive(Clone, Copy)]
pub struct RecordedTick {
    /// Its number.
    pub number: u32,
    /// True if its clock was not trusted.
    pub clock_failed: bool,
    /// Number of the configuration that it was the first to fly, if any.
    pub adopted: Option<u16>,
    /// Rotor speed at which the notch stands from it on, if it has moved \[rad/s\].
    pub notch_rad_s: Option<f32>,
    /// What it took of the sensors.
    pub readings: Readings,
    /// What it took of the battery.
    pub battery: Option<BatteryReading>,
    /// What it gave.
    pub report: Report,
}

static RECORDS: AtomicBool = AtomicBool::new(false);
static TICKS: Mutex<CriticalSectionRawMutex, RefCell<Deque<RecordedTick, WAITING>>> =
    Mutex::new(RefCell::new(Deque::new()));

/// True if ticks are kept for the exact log.
pub fn records() -> bool {
    RECORDS.load(Ordering::Relaxed)
}

/// Keeps a tick. Out of line, since few vehicles do.
#[cold]
#[inline(never)]
pub fn push(tick: &RecordedTick) {
    // Not borrowed elsewhere while it is locked; no panic in any case.
    let _ = TICKS.lock(|ticks| ticks.try_borrow_mut().ok().map(|mut ticks| ticks.push_back(*tick).is_ok()));
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
    pub fn tick(&mut self, tick: &RecordedTick) {
        let RecordedTick { number, clock_failed, adopted, notch_rad_s, readings, battery, report } = *tick;
        let (time_us, given) = (report.time_us, Given::of(&report));
        self.queue.tick(&TickRecord { number, time_us, clock_failed, readings, battery, adopted, notch_rad_s, given });
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

/// Returns the oldest tick that is kept.
pub fn pop() -> Option<RecordedTick> {
    TICKS.lock(|ticks| ticks.try_borrow_mut().ok()?.pop_front())
}

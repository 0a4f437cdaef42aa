//! Time base: embassy-time on SysTick, the one timer that all chips and the emulator share.
//!
//! Its period of 1 ms is the control period. The counter within it resolves 1 us, and measures the control tick in core
//! cycles. Alarms have the resolution of the period.

use core::cell::{Cell, RefCell};
use core::task::Waker;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{SCB, SYST};
use critical_section::{CriticalSection, Mutex};
use embassy_time::Instant;
use embassy_time_driver::Driver;
#[doc(hidden)]
pub use embassy_time_driver::time_driver_impl;

/// Microseconds of one control period.
const US_PER_TICK: u64 = 1000;

/// The time base of a core with `CYCLES_PER_US` cycles per microsecond; [`image!`](crate::image!) installs it.
pub struct SysTickDriver<const CYCLES_PER_US: u32>;

/// Where it is.
struct State {
    /// Start of the current period \[us\].
    period_us: Mutex<Cell<u64>>,
    alarms: Mutex<RefCell<[Option<Alarm>; ALARMS]>>,
}

/// Number of tasks that can wait at the same time: nine do, on a board with a card and two timers of motors. A further
/// one is woken at once and waits again, which keeps what is below it from running.
const ALARMS: usize = 10;

/// A task waiting for a time.
struct Alarm {
    at_us: u64,
    waker: Waker,
}

impl State {
    /// Calls `change` with the alarms. They are not borrowed elsewhere while interrupts are off, and nothing here may
    /// panic, since nothing flies without it.
    fn with_alarms(&self, cs: CriticalSection, change: impl FnOnce(&mut [Option<Alarm>; ALARMS])) {
        if let Ok(mut alarms) = self.alarms.borrow(cs).try_borrow_mut() {
            change(&mut alarms);
        }
    }
}

static STATE: State =
    State { period_us: Mutex::new(Cell::new(0)), alarms: Mutex::new(RefCell::new([const { None }; ALARMS])) };

/// Starts the time base of a core that runs at `core_hz`; its interrupt priority must be set before.
pub(crate) fn start(mut syst: SYST, core_hz: u32) {
    syst.set_clock_source(SystClkSource::Core);
    syst.set_reload(core_hz / 1000 - 1);
    syst.clear_current();
    syst.enable_interrupt();
    syst.enable_counter();
}

/// Returns the start of the next control period.
pub fn next_period() -> Instant {
    let period_us = critical_section::with(|cs| {
        let period_us = STATE.period_us.borrow(cs).get();
        if SCB::is_pendst_pending() { period_us + US_PER_TICK } else { period_us }
    });
    Instant::from_micros(period_us + US_PER_TICK)
}

/// A stopwatch in core cycles, for durations of less than one period.
#[derive(Clone, Copy)]
pub struct Stopwatch(u32);

impl Stopwatch {
    /// Starts it.
    pub fn start() -> Self {
        Stopwatch(SYST::get_current())
    }

    /// Returns the cycles since the start, of a core that runs at `core_hz`; the emulator counts instructions instead.
    pub fn cycles(&self, core_hz: u32) -> u32 {
        // SysTick counts down and wraps from 0 to its reload value.
        let (start, now) = (self.0, SYST::get_current());
        if now <= start { start - now } else { start + core_hz / 1000 - now }
    }
}

impl<const CYCLES_PER_US: u32> Driver for SysTickDriver<CYCLES_PER_US> {
    fn now(&self) -> u64 {
        critical_section::with(|cs| {
            let mut period_us = STATE.period_us.borrow(cs).get();
            let mut left = SYST::get_current();
            if SCB::is_pendst_pending() {
                // The period has ended, but its interrupt has not run yet; `left` may be from before or after the end.
                period_us += US_PER_TICK;
                left = SYST::get_current();
            }
            period_us + u64::from((1000 * CYCLES_PER_US - 1).saturating_sub(left) / CYCLES_PER_US)
        })
    }

    fn schedule_wake(&self, at: u64, waker: &Waker) {
        critical_section::with(|cs| {
            if at <= STATE.period_us.borrow(cs).get() {
                return waker.wake_by_ref();
            }
            STATE.with_alarms(cs, |alarms| {
                if let Some(known) = alarms.iter_mut().flatten().find(|alarm| alarm.waker.will_wake(waker)) {
                    known.at_us = known.at_us.min(at);
                    return;
                }
                match alarms.iter_mut().find(|alarm| alarm.is_none()) {
                    Some(free) => *free = Some(Alarm { at_us: at, waker: waker.clone() }),
                    None => waker.wake_by_ref(),
                }
            });
        });
    }
}

#[cortex_m_rt::exception]
fn SysTick() {
    critical_section::with(|cs| {
        let period_us = STATE.period_us.borrow(cs).get() + US_PER_TICK;
        STATE.period_us.borrow(cs).set(period_us);
        STATE.with_alarms(cs, |alarms| {
            for slot in alarms {
                // Most are not due: not moved until then.
                if slot.as_ref().is_some_and(|alarm| alarm.at_us <= period_us)
                    && let Some(due) = slot.take()
                {
                    due.waker.wake();
                }
            }
        });
    });
}

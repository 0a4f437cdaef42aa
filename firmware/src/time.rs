//! Time base: embassy-time on SysTick, the one timer that all chips and the emulator have.
//!
//! SysTick's period of 1 ms is the control period. Its counter resolves 1 us, and measures the control tick in core
//! cycles. Tasks wake with a resolution of one period.

use core::cell::{Cell, RefCell};
use core::task::Waker;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{SCB, SYST};
use critical_section::Mutex;
use embassy_time::Instant;
use embassy_time_driver::Driver;
#[doc(hidden)]
pub use embassy_time_driver::time_driver_impl;
use embassy_time_queue_utils::Queue;

/// Control period \[us\].
const US_PER_TICK: u64 = 1000;

/// embassy-time driver of a core with `CYCLES_PER_US` cycles per microsecond; [`image!`](crate::image!) installs it.
pub struct SysTickDriver<const CYCLES_PER_US: u32>;

/// State of the time base.
struct State {
    /// Start of the current period \[us\].
    period_us: Cell<u64>,
    /// Tasks that wait for a time.
    waiting: RefCell<Queue>,
    /// Earliest time that a task waits for \[us\].
    next_us: Cell<u64>,
}

impl State {
    /// Wakes the tasks whose time has come. Must not panic, since no flight goes on without the time base. The borrow
    /// succeeds, since nothing else borrows while interrupts are off.
    fn wake_due(&self) {
        let now_us = self.period_us.get();
        if now_us >= self.next_us.get()
            && let Ok(mut waiting) = self.waiting.try_borrow_mut()
        {
            self.next_us.set(waiting.next_expiration(now_us));
        }
    }
}

static STATE: Mutex<State> =
    Mutex::new(State { period_us: Cell::new(0), waiting: RefCell::new(Queue::new()), next_us: Cell::new(u64::MAX) });

/// Starts the time base of a core that runs at `core_hz`. The priority of its interrupt must be set before.
pub(crate) fn start(mut syst: SYST, core_hz: u32) {
    syst.set_clock_source(SystClkSource::Core);
    // The reload value is one less than the period, because the counter passes through 0 as well.
    syst.set_reload(core_hz / 1000 - 1);
    syst.clear_current();
    syst.enable_interrupt();
    syst.enable_counter();
}

/// Returns the start of the next control period.
pub fn next_period() -> Instant {
    let period_us = critical_section::with(|cs| {
        let period_us = STATE.borrow(cs).period_us.get();
        // If a period has just ended, its interrupt is pending and the period not counted yet, since interrupts are
        // off.
        if SCB::is_pendst_pending() { period_us + US_PER_TICK } else { period_us }
    });
    Instant::from_micros(period_us + US_PER_TICK)
}

/// Stopwatch in core cycles, for durations shorter than one period.
#[derive(Clone, Copy)]
pub struct Stopwatch(u32);

impl Stopwatch {
    /// Starts a stopwatch.
    pub fn start() -> Self {
        Stopwatch(SYST::get_current())
    }

    /// Returns the cycles since the start, on a core that runs at `core_hz`. The emulator counts instructions instead.
    pub fn cycles(&self, core_hz: u32) -> u32 {
        // SysTick counts down and wraps from 0 to its reload value.
        let (start, now) = (self.0, SYST::get_current());
        if now <= start { start - now } else { start + core_hz / 1000 - now }
    }
}

impl<const CYCLES_PER_US: u32> Driver for SysTickDriver<CYCLES_PER_US> {
    fn now(&self) -> u64 {
        critical_section::with(|cs| {
            let mut period_us = STATE.borrow(cs).period_us.get();
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
            let state = STATE.borrow(cs);
            if at <= state.period_us.get() {
                return waker.wake_by_ref();
            }
            if let Ok(mut waiting) = state.waiting.try_borrow_mut()
                && waiting.schedule_wake(at, waker)
            {
                state.next_us.set(state.next_us.get().min(at));
            }
        });
    }
}

#[cortex_m_rt::exception]
fn SysTick() {
    critical_section::with(|cs| {
        let state = STATE.borrow(cs);
        state.period_us.set(state.period_us.get() + US_PER_TICK);
        state.wake_due();
    });
}

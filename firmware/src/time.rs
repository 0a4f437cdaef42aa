//! Time base: embassy-time on SysTick, the one timer of the core that silicon and emulator share.
//!
//! Its period of 1 ms is the control period; the counter within it gives the time to 1 us, and times the control tick
//! in core cycles. Alarms have the resolution of the period.

use core::cell::{Cell, RefCell};
use core::task::Waker;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{SCB, SYST};
use critical_section::Mutex;
use embassy_time::Instant;
use embassy_time_driver::Driver;
use embassy_time_queue_utils::Queue;

/// Clock of the core and of SysTick \[Hz\].
pub const CORE_HZ: u32 = 168_000_000;
/// Core cycles of one control period.
pub const CYCLES_PER_TICK: u32 = CORE_HZ / 1000;
/// Core cycles of one microsecond.
const CYCLES_PER_US: u32 = CORE_HZ / 1_000_000;
/// Microseconds of one control period.
const US_PER_TICK: u64 = 1000;

struct SysTickDriver {
    /// Start of the current period \[us\].
    period_us: Mutex<Cell<u64>>,
    alarms: Mutex<RefCell<Queue>>,
}

embassy_time_driver::time_driver_impl!(static DRIVER: SysTickDriver = SysTickDriver {
    period_us: Mutex::new(Cell::new(0)),
    alarms: Mutex::new(RefCell::new(Queue::new())),
});

/// Starts the time base, whose interrupt must have its priority by then. The core must run at [`CORE_HZ`].
pub fn start(mut syst: SYST) {
    syst.set_clock_source(SystClkSource::Core);
    syst.set_reload(CYCLES_PER_TICK - 1);
    syst.clear_current();
    syst.enable_interrupt();
    syst.enable_counter();
}

/// When the next control period begins.
pub fn next_period() -> Instant {
    let period_us = critical_section::with(|cs| {
        let period_us = DRIVER.period_us.borrow(cs).get();
        if SCB::is_pendst_pending() { period_us + US_PER_TICK } else { period_us }
    });
    Instant::from_micros(period_us + US_PER_TICK)
}

/// A stopwatch in core cycles, for what takes less than one period.
#[derive(Clone, Copy)]
pub struct Stopwatch(u32);

impl Stopwatch {
    /// Starts now.
    pub fn start() -> Self {
        Stopwatch(SYST::get_current())
    }

    /// Core cycles since the start; under emulation with counted instructions, 1.344 an instruction.
    pub fn cycles(&self) -> u32 {
        // SysTick counts down and wraps from 0 to its reload value.
        let (start, now) = (self.0, SYST::get_current());
        if now <= start { start - now } else { start + CYCLES_PER_TICK - now }
    }
}

impl Driver for SysTickDriver {
    fn now(&self) -> u64 {
        critical_section::with(|cs| {
            let mut period_us = self.period_us.borrow(cs).get();
            let mut left = SYST::get_current();
            if SCB::is_pendst_pending() {
                // The period ended and its interrupt has yet to run; `left` may be from either side of that end.
                period_us += US_PER_TICK;
                left = SYST::get_current();
            }
            period_us + u64::from((CYCLES_PER_TICK - 1).saturating_sub(left) / CYCLES_PER_US)
        })
    }

    fn schedule_wake(&self, at: u64, waker: &Waker) {
        critical_section::with(|cs| {
            let mut alarms = self.alarms.borrow(cs).borrow_mut();
            if alarms.schedule_wake(at, waker) {
                // Wakes at once what is already due; the rest waits for the next period.
                alarms.next_expiration(self.period_us.borrow(cs).get());
            }
        });
    }
}

#[cortex_m_rt::exception]
fn SysTick() {
    critical_section::with(|cs| {
        let period_us = DRIVER.period_us.borrow(cs);
        period_us.set(period_us.get() + US_PER_TICK);
        DRIVER.alarms.borrow(cs).borrow_mut().next_expiration(period_us.get());
    });
}

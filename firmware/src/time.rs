//! Time base: embassy-time on SysTick, the one timer that silicon and emulator share.
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
    alarms: Mutex<RefCell<[Option<Alarm>; ALARMS]>>,
}

/// Number of tasks that can wait at the same time; four do. Further ones are woken at once and wait again.
const ALARMS: usize = 8;

/// A task waiting for a time.
struct Alarm {
    at_us: u64,
    waker: Waker,
}

impl SysTickDriver {
    /// Calls `change` with the alarms. They are not borrowed elsewhere while interrupts are off, and nothing here may
    /// panic, since nothing flies without it.
    fn with_alarms(&self, cs: CriticalSection, change: impl FnOnce(&mut [Option<Alarm>; ALARMS])) {
        if let Ok(mut alarms) = self.alarms.borrow(cs).try_borrow_mut() {
            change(&mut alarms);
        }
    }
}

embassy_time_driver::time_driver_impl!(static DRIVER: SysTickDriver = SysTickDriver {
    period_us: Mutex::new(Cell::new(0)),
    alarms: Mutex::new(RefCell::new([const { None }; ALARMS])),
});

/// Starts the time base, whose interrupt priority must be set before. The core must run at [`CORE_HZ`].
pub fn start(mut syst: SYST) {
    syst.set_clock_source(SystClkSource::Core);
    syst.set_reload(CYCLES_PER_TICK - 1);
    syst.clear_current();
    syst.enable_interrupt();
    syst.enable_counter();
}

/// Returns the start of the next control period.
pub fn next_period() -> Instant {
    let period_us = critical_section::with(|cs| {
        let period_us = DRIVER.period_us.borrow(cs).get();
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

    /// Returns the core cycles since the start; under emulation, 1.344 per instruction.
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
                // The period has ended, but its interrupt has not run yet; `left` may be from before or after the end.
                period_us += US_PER_TICK;
                left = SYST::get_current();
            }
            period_us + u64::from((CYCLES_PER_TICK - 1).saturating_sub(left) / CYCLES_PER_US)
        })
    }

    fn schedule_wake(&self, at: u64, waker: &Waker) {
        critical_section::with(|cs| {
            if at <= self.period_us.borrow(cs).get() {
                return waker.wake_by_ref();
            }
            self.with_alarms(cs, |alarms| {
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
        let period_us = DRIVER.period_us.borrow(cs).get() + US_PER_TICK;
        DRIVER.period_us.borrow(cs).set(period_us);
        DRIVER.with_alarms(cs, |alarms| {
            for slot in alarms {
                if let Some(due) = slot.take_if(|alarm| alarm.at_us <= period_us) {
                    due.waker.wake();
                }
            }
        });
    });
}

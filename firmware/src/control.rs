//! The control tick, 1000 times per second.

use crate::board::Board;
use crate::escs;
use crate::logging;
use crate::recording;
use crate::samples::{self, Sampler as _};
use crate::ticks::{self, Tick};
use crate::time::{self, Stopwatch};
use crate::vehicle::{Flight, Prepared};
use afbc_onboard::{Configuration, ControlInputs, Report, TickBefore, TickDetails, TickInputs};
use core::cell::RefCell;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_time::{Instant, Timer};
use static_cell::StaticCell;

/// Newest inputs, written by [`crate::comms`], and the number of the tick that will take them.
static MAIL: Mutex<CriticalSectionRawMutex, RefCell<(ControlInputs, u32)>> =
    Mutex::new(RefCell::new((ControlInputs::EMPTY, 0)));

/// Duration of the last control tick and of the longest one \[core cycles\], for [`crate::housekeeping`].
static CYCLES: AtomicU32 = AtomicU32::new(0);
static CYCLES_MAX: AtomicU32 = AtomicU32::new(0);

/// Returns the durations of the last and the longest control tick, interrupts included \[core cycles\].
pub fn cycles() -> [u32; 2] {
    [&CYCLES, &CYCLES_MAX].map(|cycles| cycles.load(Ordering::Relaxed))
}

/// Configuration to adopt at the next disarmed tick.
///
/// Not an [`Option`], whose `None` is not all zeros: the static's initial value would take 3.6 kB of flash.
#[repr(u8)]
#[allow(clippy::large_enum_variant, reason = "there is one")]
enum NextConfiguration {
    Nothing = 0,
    /// The configuration and its number.
    Is(Prepared, u16),
}

static NEXT: Mutex<CriticalSectionRawMutex, RefCell<NextConfiguration>> =
    Mutex::new(RefCell::new(NextConfiguration::Nothing));
/// True if the vehicle was armed in the last tick.
static ARMED: AtomicBool = AtomicBool::new(false);

/// Hands over a configuration and its number, for the next disarmed tick to adopt.
pub fn fly(prepared: Prepared, number: u16) {
    NEXT.lock(|next| next.try_borrow_mut().ok().map(|mut next| *next = NextConfiguration::Is(prepared, number)));
}

/// True if the vehicle is armed.
pub fn armed() -> bool {
    ARMED.load(Ordering::Relaxed)
}

/// Changes the inputs of the next tick, and returns that tick's number.
pub fn with_mail(change: impl FnOnce(&mut ControlInputs)) -> u32 {
    // `try_borrow_mut` succeeds, since nothing else borrows while the lock is held.
    let tick = MAIL.lock(|shared| {
        let mut shared = shared.try_borrow_mut().ok()?;
        change(&mut shared.0);
        Some(shared.1)
    });
    tick.unwrap_or_default()
}

/// Creates the disarmed vehicle. Must be called once. It is built in place, because passing it to the task by value
/// would store it twice and use stack.
///
/// # Panics
/// If one of the vehicle's parameters is out of range.
#[inline(never)]
pub fn make(configuration: &Configuration) -> &'static mut Flight {
    static FLIGHT: StaticCell<Flight> = StaticCell::new();
    FLIGHT.init_with(|| {
        let Ok(flight) = Flight::new(configuration) else { panic!("a parameter of the vehicle is out of range") };
        flight
    })
}

/// Runs the control task.
pub async fn run<B: Board>(flight: &mut Flight, board: &mut B) -> ! {
    let (mut messages, mut inputs, mut before) = (ControlInputs::EMPTY, TickInputs::default(), TickBefore::default());
    let mut details = if recording::is_possible::<B>() { ticks::details_in() } else { None };
    loop {
        // A `Ticker` is not used, because its periods begin when it is created. Alarms are due just after a control
        // period starts, so a ticker would tick twice in every second period.
        Timer::at(time::next_period()).await;
        let stopwatch = Stopwatch::start();
        let report = tick(flight, &mut messages, &mut inputs, &mut before, board);
        let mut is_detailed = false;
        if recording::is_possible::<B>()
            && (recording::records() || B::HAS_LOG && logging::is_wanted())
            && let Some(slot) = details.as_mut().and_then(|details| details.try_send())
        {
            (inputs.time_us, inputs.battery, is_detailed) = (report.time_us, messages.battery, true);
            if B::HAS_LOG {
                write_details(slot, flight, &inputs, &before, &messages);
            } else {
                // The exact log needs nothing else, so an image without a black box leaves the other details out.
                slot.inputs = inputs;
            }
        }
        if B::Sampler::IS_REDUNDANT {
            samples::cross_check(flight, &inputs.readings);
        }
        if recording::is_possible::<B>() {
            (inputs.adopted, inputs.notch_rad_s) = (None, None);
        }
        if B::ESCS {
            inputs.notch_rad_s = move_notch(flight);
        }
        ARMED.store(report.mode.armed(), Ordering::Relaxed);
        if !report.mode.armed() {
            inputs.adopted = adopt(flight);
        }
        let cycles = stopwatch.cycles(B::CORE_HZ);
        CYCLES.store(cycles, Ordering::Relaxed);
        CYCLES_MAX.fetch_max(cycles, Ordering::Relaxed);
        let is_queued = ticks::push(Tick { report, cycles, is_detailed });
        // A tick that is not queued leaves its slot of details to the next tick.
        if is_queued
            && is_detailed
            && let Some(details) = &mut details
        {
            details.send_done();
        }
    }
}

/// Stores the details of a tick that logs need besides its report. It is not inlined, since only boards that keep logs
/// use it.
#[cold]
#[inline(never)]
fn write_details(
    slot: &mut TickDetails,
    flight: &Flight,
    inputs: &TickInputs,
    before: &TickBefore,
    messages: &ControlInputs,
) {
    *slot = flight.details(inputs, before, messages);
}

/// Moves the notch filter if a new place is set, and returns its centre \[rad/s\]. It is not inlined, like `tick`.
#[inline(never)]
fn move_notch(flight: &mut Flight) -> Option<f32> {
    let notch = escs::moved_notch()?;
    flight.move_notch(&notch);
    Some(notch.centre_rad_s())
}

/// Adopts the next configuration, if there is one, and returns its number. It is not inlined, since it runs rarely.
#[inline(never)]
fn adopt(flight: &mut Flight) -> Option<u16> {
    NEXT.lock(|next| {
        let mut next = next.try_borrow_mut().ok()?;
        let NextConfiguration::Is(prepared, number) = &*next else { return None };
        // The caller has checked that the vehicle is disarmed.
        let adopted = flight.adopt(prepared).then_some(*number);
        *next = NextConfiguration::Nothing;
        adopted
    })
}

/// Runs one control tick: takes the newest inputs; supervises, controls and gates the motors
/// ([`afbc_flight_core::tick`]); drives them; checks the rate. It is not inlined, so that its stack and its
/// instructions can be counted (`docs/budgets.md`).
#[inline(never)]
fn tick<B: Board>(
    flight: &mut Flight,
    messages: &mut ControlInputs,
    inputs: &mut TickInputs,
    before: &mut TickBefore,
    board: &mut B,
) -> Report {
    let now_us = Instant::now().as_micros();
    // `try_borrow_mut` succeeds, since nothing else borrows while the lock is held. The tick must not panic.
    MAIL.lock(|shared| {
        let Ok(mut shared) = shared.try_borrow_mut() else { return };
        let (mail, next) = &mut *shared;
        mail.take_into(messages);
        if recording::is_possible::<B>() {
            // The number is stored in place. Returned with the report, it would make the tick copy the report.
            inputs.number = *next;
            *next = next.wrapping_add(1);
        }
    });

    if B::HAS_LOG && logging::is_wanted() {
        *before = flight.before(messages);
    }
    let clock_failed = board.clock_has_failed();
    if recording::is_possible::<B>() {
        inputs.clock_failed = clock_failed;
    }
    // The flight goes on with a clock that is off by up to 1 %; the vehicle cannot arm again.
    if clock_failed {
        flight.distrust_clock();
    }
    if B::Sampler::SENSES {
        samples::take(now_us, &mut inputs.readings);
    } else {
        // Lets the compiler drop the code that only sensors need.
        inputs.readings.clear();
    }
    let report = flight.tick(now_us, messages, &inputs.readings);

    board.drive(&report.throttles);
    // A failed task is restarted by a reset, unless the vehicle is armed.
    let may_reset = board.task_has_failed() && !report.mode.armed();
    // Fed at a wrong tick rate too, since in the air that is better than a reset; not fed if the clock has stopped.
    if report.health.rate.alive && !may_reset {
        board.feed_watchdog();
    }
    report
}

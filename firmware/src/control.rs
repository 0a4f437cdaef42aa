//! The control tick, 1000 times per second.

use crate::board::Board;
use crate::escs;
use crate::logging;
use crate::recording;
use crate::samples::{self, Sampler as _};
use crate::ticks::{self, Tick};
use crate::time::{self, Stopwatch};
use crate::vehicle::{Configuration, Flight, Prepared, Report};
use afbc_onboard::{ControlInputs, TickBefore, TickDetails, TickInputs};
use core::cell::RefCell;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_time::{Instant, Timer};
use static_cell::StaticCell;

/// Newest inputs, written by [`crate::comms`], and the number of the tick that takes them.
static MAIL: Mutex<CriticalSectionRawMutex, RefCell<(ControlInputs, u32)>> =
    Mutex::new(RefCell::new((ControlInputs::EMPTY, 0)));

/// Cycles of the last control tick and of the longest, for [`crate::housekeeping`].
static CYCLES: AtomicU32 = AtomicU32::new(0);
static CYCLES_MAX: AtomicU32 = AtomicU32::new(0);

/// Returns the duration of the last control tick, and the longest so far, interrupts included \[core cycles\].
pub fn cycles() -> [u32; 2] {
    [&CYCLES, &CYCLES_MAX].map(|cycles| cycles.load(Ordering::Relaxed))
}

/// Configuration to be flown from the next disarmed tick on.
///
/// Not an [`Option`], of which nothing is not all zeros: the flash would have 3.6 kB for it.
#[repr(u8)]
#[allow(clippy::large_enum_variant, reason = "there is one")]
enum NextConfiguration {
    Nothing = 0,
    /// With its number.
    Is(Prepared, u16),
}

static NEXT: Mutex<CriticalSectionRawMutex, RefCell<NextConfiguration>> =
    Mutex::new(RefCell::new(NextConfiguration::Nothing));
/// True if the vehicle was armed in the last tick.
static ARMED: AtomicBool = AtomicBool::new(false);

/// Flies another configuration, of this number, from the next disarmed tick on.
pub fn fly(prepared: Prepared, number: u16) {
    NEXT.lock(|next| next.try_borrow_mut().ok().map(|mut next| *next = NextConfiguration::Is(prepared, number)));
}

/// True if the vehicle is armed.
pub fn armed() -> bool {
    ARMED.load(Ordering::Relaxed)
}

/// Changes the inputs of the next tick, and returns its number.
pub fn with_mail(change: impl FnOnce(&mut ControlInputs)) -> u32 {
    // Not borrowed elsewhere while it is locked; no panic in any case.
    let tick = MAIL.lock(|shared| {
        let mut shared = shared.try_borrow_mut().ok()?;
        change(&mut shared.0);
        Some(shared.1)
    });
    tick.unwrap_or_default()
}

/// Creates the vehicle, disarmed, to be called once: in place, since a task would store a value twice and take the
/// stack for it.
///
/// # Panics
/// If one of its parameters is out of range.
#[inline(never)]
pub fn make(configuration: &Configuration) -> &'static mut Flight {
    static FLIGHT: StaticCell<Flight> = StaticCell::new();
    FLIGHT.init_with(|| {
        let Ok(flight) = Flight::new(configuration) else { panic!("a parameter of the vehicle is out of range") };
        flight
    })
}

/// Runs the ticks.
pub async fn run<B: Board>(flight: &mut Flight, board: &mut B) -> ! {
    let (mut messages, mut inputs, mut before) = (ControlInputs::EMPTY, TickInputs::default(), TickBefore::default());
    let mut details = if recording::is_possible::<B>() { ticks::details_in() } else { None };
    loop {
        // Not a ticker, whose periods begin when it is created: just after the start of a control period, when alarms
        // are due, it would tick twice in every second period.
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
                // The exact log has no more of them: what tells the rest is not in the image.
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
        // Of a tick that is not queued, the next one takes the place.
        if is_queued
            && is_detailed
            && let Some(details) = &mut details
        {
            details.send_done();
        }
    }
}

/// Writes down what logs have of a tick beside its report. Out of line, since only boards that keep logs do.
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

/// Moves the notch, if it is to be moved; returns where to \[rad/s\]. Out of line, as below.
#[inline(never)]
fn move_notch(flight: &mut Flight) -> Option<f32> {
    let notch = escs::moved_notch()?;
    flight.move_notch(&notch);
    Some(notch.centre_rad_s())
}

/// Takes over a configuration, if there is one, and returns its number. Out of line, since it is rare.
#[inline(never)]
fn adopt(flight: &mut Flight) -> Option<u16> {
    NEXT.lock(|next| {
        let mut next = next.try_borrow_mut().ok()?;
        let NextConfiguration::Is(prepared, number) = &*next else { return None };
        // Disarmed: the caller has looked.
        let adopted = flight.adopt(prepared).then_some(*number);
        *next = NextConfiguration::Nothing;
        adopted
    })
}

/// The top loop: takes the newest inputs; supervises, controls and gates the motors ([`afbc_flight_core::tick`]);
/// drives them; checks the rate. Out of line, so that its stack and its instructions can be counted
/// (`docs/budgets.md`).
#[inline(never)]
fn tick<B: Board>(
    flight: &mut Flight,
    messages: &mut ControlInputs,
    inputs: &mut TickInputs,
    before: &mut TickBefore,
    board: &mut B,
) -> Report {
    let now_us = Instant::now().as_micros();
    // Not borrowed elsewhere while it is locked; the tick has no panic.
    MAIL.lock(|shared| {
        let Ok(mut shared) = shared.try_borrow_mut() else { return };
        let (mail, next) = &mut *shared;
        mail.take_into(messages);
        if recording::is_possible::<B>() {
            // In place: returned beside the report, it would cost the tick a copy of that.
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
    // Flown on, by a clock that is off by up to 1 %; the vehicle is not armed again.
    if clock_failed {
        flight.distrust_clock();
    }
    if B::Sampler::SENSES {
        samples::take(now_us, &mut inputs.readings);
    } else {
        // So that the compiler leaves out what only sensors need.
        inputs.readings.clear();
    }
    let report = flight.tick(now_us, messages, &inputs.readings);

    board.drive(report.throttles);
    // A reset restarts a failed task, once it does not end a flight.
    let may_reset = board.task_has_failed() && !report.mode.armed();
    // Whatever the rate: in the air a wrong one is better than a reset. Not if the clock stands still.
    if report.health.rate.alive && !may_reset {
        board.feed_watchdog();
    }
    report
}

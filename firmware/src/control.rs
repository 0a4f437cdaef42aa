//! The control tick, 1000 times per second.

use crate::board::Board;
use crate::time::{self, Stopwatch};
use crate::vehicle::{CONFIGURATION, ROTORS};
use afbc_flight_core::Inbox;
use afbc_onboard::Readings;
use core::cell::RefCell;
use core::future::poll_fn;
use core::pin::pin;
use core::sync::atomic::{AtomicU32, Ordering};
use core::task::Poll;
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Instant, Timer};
use heapless::Deque;

/// The vehicle under its law.
pub type Flight = afbc_onboard::Flight<ROTORS>;
/// What one of its ticks decided.
pub type Report = afbc_onboard::Report<ROTORS>;

/// Newest inputs, written by [`crate::comms`].
static INBOX: Mutex<CriticalSectionRawMutex, RefCell<Inbox>> = Mutex::new(RefCell::new(Inbox::EMPTY));

/// Results of the last ticks, and a signal that there are some. Not a channel, which panics when it is re-entered.
static TICKS: Mutex<CriticalSectionRawMutex, RefCell<Deque<Tick, 8>>> = Mutex::new(RefCell::new(Deque::new()));
static TICKED: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// Waits for the result of the oldest tick not yet returned. A tick never waits: while eight results are queued,
/// further ones are dropped.
pub fn next_tick() -> impl Future<Output = Tick> {
    poll_fn(|context| {
        // Registered before looking, so that no tick is missed.
        let _ = pin!(TICKED.wait()).poll(context);
        match TICKS.lock(|ticks| ticks.try_borrow_mut().ok()?.pop_front()) {
            Some(tick) => Poll::Ready(tick),
            None => Poll::Pending,
        }
    })
}

/// Cycles of the last control tick and of the longest, for [`crate::housekeeping`].
static CYCLES: AtomicU32 = AtomicU32::new(0);
static CYCLES_MAX: AtomicU32 = AtomicU32::new(0);

/// Returns the duration of the last control tick, and the longest so far, interrupts included \[core cycles\].
pub fn cycles() -> [u32; 2] {
    [&CYCLES, &CYCLES_MAX].map(|cycles| cycles.load(Ordering::Relaxed))
}

/// Result of one control tick.
#[derive(Clone, Copy)]
pub struct Tick {
    /// Report of the flight core.
    pub report: Report,
    /// Duration, interrupts included \[core cycles\].
    pub cycles: u32,
}

/// Changes the inputs of the next tick.
pub fn with_inbox(change: impl FnOnce(&mut Inbox)) {
    // Not borrowed elsewhere while it is locked; no panic in any case.
    INBOX.lock(|inbox| inbox.try_borrow_mut().ok().map(|mut inbox| change(&mut inbox)));
}

/// Creates the vehicle, disarmed.
///
/// # Panics
/// If one of its parameters is out of range.
pub fn flight() -> Flight {
    let Ok(flight) = Flight::new(&CONFIGURATION) else { panic!("a parameter of the vehicle is out of range") };
    flight
}

/// Runs the ticks. `flight` is a reference, since a task would store a value twice.
pub async fn run(flight: &mut Flight, board: &mut impl Board) -> ! {
    let (mut inbox, mut readings) = (Inbox::EMPTY, Readings::NONE);
    loop {
        // Not a ticker, whose periods begin when it is created: just after the start of a control period, when alarms
        // are due, it would tick twice in every second period.
        Timer::at(time::next_period()).await;
        let stopwatch = Stopwatch::start();
        let report = tick(flight, &mut inbox, &mut readings, board);
        let cycles = stopwatch.cycles();
        CYCLES.store(cycles, Ordering::Relaxed);
        CYCLES_MAX.fetch_max(cycles, Ordering::Relaxed);
        // Full if the link's task falls behind: then this tick is not reported.
        let push = |ticks: &RefCell<Deque<_, _>>| ticks.try_borrow_mut().ok()?.push_back(Tick { report, cycles }).ok();
        if TICKS.lock(push).is_some() {
            TICKED.signal(());
        }
    }
}

/// The top loop: takes the newest inputs; supervises, controls and gates the motors ([`afbc_flight_core::tick`]);
/// drives them; checks the rate. Out of line, so that its stack and its instructions can be counted
/// (`docs/budgets.md`).
#[inline(never)]
fn tick<B: Board>(flight: &mut Flight, inbox: &mut Inbox, readings: &mut Readings, board: &mut B) -> Report {
    let now_us = Instant::now().as_micros();
    // Not borrowed elsewhere while it is locked; the tick has no panic.
    INBOX.lock(|shared| shared.try_borrow_mut().ok().map(|mut shared| shared.take_into(inbox)));

    if board.clock_has_failed() {
        flight.distrust_clock();
    }
    board.sense(readings);
    let report = flight.tick(now_us, inbox, readings);

    board.drive(report.throttles);
    // A reset restarts a failed task, once it does not end a flight.
    let may_reset = board.task_has_failed() && !report.mode.armed();
    if report.health.rate.alive && !may_reset {
        board.feed_watchdog();
    }
    report
}

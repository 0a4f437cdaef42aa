//! The control tick, 1000 times a second.

use crate::board::Board;
use crate::time::{self, Stopwatch};
use afbc_flight_core::Inbox;
pub use afbc_onboard::Flight;
use afbc_onboard::Report;
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

/// Newest inputs, written by [`crate::comms`].
static INBOX: Mutex<CriticalSectionRawMutex, RefCell<Inbox>> = Mutex::new(RefCell::new(Inbox::EMPTY));

/// What the last ticks did, and that there are some. Not a channel, which panics if it is used while it is used.
static TICKS: Mutex<CriticalSectionRawMutex, RefCell<Deque<Tick, 8>>> = Mutex::new(RefCell::new(Deque::new()));
static TICKED: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// What the oldest tick did that nobody has asked for yet. A tick never waits: if nobody asks for eight ticks, the next
/// are left out.
pub fn next_tick() -> impl Future<Output = Tick> {
    poll_fn(|context| {
        // Before the look, so that none comes in between.
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

/// How long the last control tick took, and the longest so far, interrupts included \[core cycles\].
pub fn cycles() -> [u32; 2] {
    [&CYCLES, &CYCLES_MAX].map(|cycles| cycles.load(Ordering::Relaxed))
}

/// One control tick.
#[derive(Clone, Copy)]
pub struct Tick {
    /// What it decided.
    pub report: Report,
    /// How long it took, interrupts included \[core cycles\].
    pub cycles: u32,
}

/// Changes what the next tick will work from.
pub fn with_inbox(change: impl FnOnce(&mut Inbox)) {
    // Borrowed by nobody else while it is locked; and no panic.
    INBOX.lock(|inbox| inbox.try_borrow_mut().ok().map(|mut inbox| change(&mut inbox)));
}

/// The vehicle, disarmed.
///
/// # Panics
/// If one of its parameters is out of range.
pub fn flight() -> Flight {
    let Ok(flight) = Flight::new() else { panic!("a parameter of the vehicle is out of range") };
    flight
}

/// Ticks. By reference: what a task hands on by value, it has room for twice.
pub async fn run(flight: &mut Flight, board: &mut impl Board) -> ! {
    loop {
        // Not by a ticker, whose periods begin whenever it was made: one that begins just after a control period, which
        // is when alarms go off, ticks twice in every other one.
        Timer::at(time::next_period()).await;
        let stopwatch = Stopwatch::start();
        let report = tick(flight, board);
        let cycles = stopwatch.cycles();
        CYCLES.store(cycles, Ordering::Relaxed);
        CYCLES_MAX.fetch_max(cycles, Ordering::Relaxed);
        // Full if comms is behind: then this tick goes unreported.
        let push = |ticks: &RefCell<Deque<_, _>>| ticks.try_borrow_mut().ok()?.push_back(Tick { report, cycles }).ok();
        if TICKS.lock(push).is_some() {
            TICKED.signal(());
        }
    }
}

/// The top loop: take the newest inputs; supervise, control and gate the motors ([`afbc_flight_core::tick`]); drive them; check
/// the rate. Out of line, so that its stack and its instructions can be counted (`docs/budgets.md`).
#[inline(never)]
fn tick<B: Board>(flight: &mut Flight, board: &mut B) -> Report {
    let now_us = Instant::now().as_micros();
    // Borrowed by nobody else while it is locked; and the tick holds no panic.
    let inbox = INBOX.lock(|inbox| inbox.try_borrow_mut().map_or(Inbox::EMPTY, |mut inbox| inbox.take()));

    if board.clock_has_failed() {
        flight.distrust_clock();
    }
    let report = flight.tick(now_us, &inbox);

    board.drive(report.throttles);
    // A task that has failed is started anew by a reset, once that ends no flight.
    let may_reset = board.task_has_failed() && !report.mode.armed();
    if report.health.rate.alive && !may_reset {
        board.feed_watchdog();
    }
    report
}

//! Results of the control ticks, from the control task to the link's.

use crate::vehicle::Report;
use core::cell::RefCell;
use core::future::poll_fn;
use core::pin::pin;
use core::task::Poll;
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use heapless::Deque;

/// Result of one control tick.
#[derive(Clone, Copy)]
pub struct Tick {
    /// Report of the flight core.
    pub report: Report,
    /// Duration, interrupts included \[core cycles\].
    pub cycles: u32,
}

/// Results of the last ticks, and a signal that there are some. Not a channel, which panics when it is re-entered.
// 20: with eight, ticks were lost on a processor of a quarter of the speed; with 20 or more, none was. With more, less
// than a quarter of the RAM is free on a board with a black box and motor controllers that answer.
static TICKS: Mutex<CriticalSectionRawMutex, RefCell<Deque<Tick, 20>>> = Mutex::new(RefCell::new(Deque::new()));
static TICKED: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// Waits for the result of the oldest tick not yet returned. A tick never waits: while twenty results are queued,
/// further ones are dropped.
pub fn next() -> impl Future<Output = Tick> {
    poll_fn(|context| {
        // Registered before looking, so that no tick is missed.
        let _ = pin!(TICKED.wait()).poll(context);
        match TICKS.lock(|ticks| ticks.try_borrow_mut().ok()?.pop_front()) {
            Some(tick) => Poll::Ready(tick),
            None => Poll::Pending,
        }
    })
}

/// Reports a tick.
pub fn push(tick: Tick) {
    // Full if the link's task falls behind: then this tick is not reported.
    let push = |ticks: &RefCell<Deque<_, _>>| ticks.try_borrow_mut().ok()?.push_back(tick).ok();
    if TICKS.lock(push).is_some() {
        TICKED.signal(());
    }
}

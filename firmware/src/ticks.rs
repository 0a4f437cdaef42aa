//! Results of the control ticks, from the control task to the links': one queue, whose ticks have their details with
//! them if a log is written.

use crate::vehicle::Report;
use afbc_onboard::TickDetails;
use core::array;
use core::cell::RefCell;
use core::future::poll_fn;
use core::pin::pin;
use core::task::Poll;
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_sync::zerocopy_channel::{Channel, Receiver, Sender};
use heapless::Deque;
use static_cell::StaticCell;

/// Details that wait, at most; further ticks are queued without, and are missing in logs.
const DETAILS: usize = 5;

/// Result of one control tick.
#[derive(Clone, Copy)]
pub struct Tick {
    /// Report of the flight core.
    pub report: Report,
    /// Duration, interrupts included \[core cycles\].
    pub cycles: u32,
    /// True if its details are the next ones that wait.
    pub is_detailed: bool,
}

/// Results of the last ticks, and a signal that there are some. Not a channel, which panics when it is re-entered.
// 20: with eight, ticks were lost on a processor of a quarter of the speed; with 20 or more, none was. With more, less
// than a quarter of the RAM is free on a board with a black box and motor controllers that answer.
static TICKS: Mutex<CriticalSectionRawMutex, RefCell<Deque<Tick, 20>>> = Mutex::new(RefCell::new(Deque::new()));
static TICKED: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// Where the control task puts details, and where the links' task finds them.
pub(crate) type DetailsIn = Sender<'static, CriticalSectionRawMutex, TickDetails>;
pub(crate) type DetailsOut = Receiver<'static, CriticalSectionRawMutex, TickDetails>;

/// Both, until the tasks take them. Each is written in place, with interrupts on: it is too long to be copied.
static ENDS: Mutex<CriticalSectionRawMutex, RefCell<Ends>> = Mutex::new(RefCell::new((None, None)));
type Ends = (Option<DetailsIn>, Option<DetailsOut>);

/// Makes room for details, to be called once, before the first tick, by a board that may write logs: the others do not
/// have its memory.
#[inline(never)]
pub(crate) fn keep_details() {
    static HELD: StaticCell<[TickDetails; DETAILS]> = StaticCell::new();
    static CHANNEL: StaticCell<Channel<'static, CriticalSectionRawMutex, TickDetails>> = StaticCell::new();
    let held = HELD.init_with(|| array::from_fn(|_| TickDetails::default()));
    let (put, take) = CHANNEL.init_with(|| Channel::new(held)).split();
    ENDS.lock(|ends| ends.try_borrow_mut().ok().map(|mut ends| *ends = (Some(put), Some(take))));
}

/// Returns the control task's end, once; none if no room was made.
pub(crate) fn details_in() -> Option<DetailsIn> {
    ENDS.lock(|ends| ends.try_borrow_mut().ok()?.0.take())
}

/// Returns the links' task's end, once; none if no room was made.
pub(crate) fn details_out() -> Option<DetailsOut> {
    ENDS.lock(|ends| ends.try_borrow_mut().ok()?.1.take())
}

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

/// Reports a tick; false if the links' task falls behind: then this tick is not reported.
pub fn push(tick: Tick) -> bool {
    let push = |ticks: &RefCell<Deque<_, _>>| ticks.try_borrow_mut().ok()?.push_back(tick).ok();
    let is_queued = TICKS.lock(push).is_some();
    if is_queued {
        TICKED.signal(());
    }
    is_queued
}

//! Queue of the control ticks' results, from the control task to the link task. Ticks carry details while a log is
//! written.

use afbc_onboard::{Report, TickDetails};
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

/// Number of details that can wait. Further ticks are queued without details and are missing in logs.
const DETAILS: usize = 5;

/// Result of one control tick.
#[derive(Clone, Copy)]
pub struct Tick {
    /// Report of the flight core.
    pub report: Report,
    /// Duration of the tick, interrupts included \[core cycles\].
    pub cycles: u32,
    /// True if the next waiting details belong to this tick.
    pub is_detailed: bool,
}

/// Queued results, and a signal that there are some. Not an embassy channel, which panics when it is re-entered.
// With 8 results, ticks were lost on a processor of a quarter of the speed; with 20, none were. More than 20 would
// leave less than a quarter of the RAM free on a board with a black box and answering motor controllers.
static TICKS: Mutex<CriticalSectionRawMutex, RefCell<Deque<Tick, 20>>> = Mutex::new(RefCell::new(Deque::new()));
static TICKED: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// Ends of the channel of details: the control task sends, the link task receives.
pub(crate) type DetailsIn = Sender<'static, CriticalSectionRawMutex, TickDetails>;
pub(crate) type DetailsOut = Receiver<'static, CriticalSectionRawMutex, TickDetails>;

/// Both ends of the channel of details, until the tasks take them. Details are written in place, outside a lock,
/// because they are too long to copy.
static ENDS: Mutex<CriticalSectionRawMutex, RefCell<Ends>> = Mutex::new(RefCell::new((None, None)));
type Ends = (Option<DetailsIn>, Option<DetailsOut>);

/// Creates the channel of details, before the first tick. Must be called once, only by a board that may write logs;
/// the others spend no memory on it.
#[inline(never)]
pub(crate) fn keep_details() {
    static HELD: StaticCell<[TickDetails; DETAILS]> = StaticCell::new();
    static CHANNEL: StaticCell<Channel<'static, CriticalSectionRawMutex, TickDetails>> = StaticCell::new();
    let held = HELD.init_with(|| array::from_fn(|_| TickDetails::default()));
    let (put, take) = CHANNEL.init_with(|| Channel::new(held)).split();
    ENDS.lock(|ends| ends.try_borrow_mut().ok().map(|mut ends| *ends = (Some(put), Some(take))));
}

/// Returns the control task's end, once; `None` if the channel was not created.
pub(crate) fn details_in() -> Option<DetailsIn> {
    ENDS.lock(|ends| ends.try_borrow_mut().ok()?.0.take())
}

/// Returns the link task's end, once; `None` if the channel was not created.
pub(crate) fn details_out() -> Option<DetailsOut> {
    ENDS.lock(|ends| ends.try_borrow_mut().ok()?.1.take())
}

/// Waits for the oldest queued result. The control tick never waits. If 20 results are queued, the tick drops its
/// result.
pub fn next() -> impl Future<Output = Tick> {
    poll_fn(|context| {
        // The waker is registered before the queue is read, so that no tick is missed.
        let _ = pin!(TICKED.wait()).poll(context);
        match TICKS.lock(|ticks| ticks.try_borrow_mut().ok()?.pop_front()) {
            Some(tick) => Poll::Ready(tick),
            None => Poll::Pending,
        }
    })
}

/// Queues the result of a tick. Returns false, and drops the result, if the queue is full because the link task is
/// behind.
pub fn push(tick: Tick) -> bool {
    let push = |ticks: &RefCell<Deque<_, _>>| ticks.try_borrow_mut().ok()?.push_back(tick).ok();
    let is_queued = TICKS.lock(push).is_some();
    if is_queued {
        TICKED.signal(());
    }
    is_queued
}

//! Interrupt executors, and the priorities of all interrupts.
//!
//! Each executor has an interrupt line that the board's peripherals leave unused; [`image!`](crate::image!) takes
//! these lines as arguments.

use core::sync::atomic::{AtomicU16, Ordering};
use cortex_m::interrupt::InterruptNumber;
use cortex_m::peripheral::SCB;
use cortex_m::peripheral::scb::{SystemHandler, VectActive};
use embassy_executor::{InterruptExecutor, SendSpawner, SpawnError, SpawnToken, Spawner};

/// Interrupt priorities; lower numbers preempt higher ones. A chip has at least sixteen, in the upper four bits of the
/// register.
pub mod priority {
    /// SysTick: [`crate::time`].
    pub const TIME: u8 = 1 << 4;
    /// Bytes to and from the links.
    pub const UART: u8 = 2 << 4;
    /// [`crate::samples`].
    pub const SAMPLING: u8 = 3 << 4;
    /// [`crate::control`].
    pub const CONTROL: u8 = 4 << 4;
    /// End of the motors' DMA transfer.
    pub const MOTOR_DMA: u8 = 6 << 4;
    /// [`crate::samples`] of slow sensors, whose drivers may wait for their bus.
    pub const AIDING: u8 = 7 << 4;
    /// [`crate::comms`].
    pub const COMMS: u8 = 8 << 4;
    /// [`crate::housekeeping`], and USB, whose hosts can wait.
    pub const HOUSEKEEPING: u8 = 12 << 4;
    /// [`crate::logging`], which waits for a memory card or flash.
    pub const LOGGING: u8 = 14 << 4;
}

static SAMPLING: InterruptExecutor = InterruptExecutor::new();
static CONTROL: InterruptExecutor = InterruptExecutor::new();
static AIDING: InterruptExecutor = InterruptExecutor::new();
static COMMS: InterruptExecutor = InterruptExecutor::new();
static HOUSEKEEPING: InterruptExecutor = InterruptExecutor::new();
static LOGGING: InterruptExecutor = InterruptExecutor::new();

/// Interrupt lines of the tasks that a flight can do without: link task, housekeeping, slow sensors, logging and USB.
// Initially a number that no interrupt has.
static DISPENSABLE: [AtomicU16; 5] = [const { AtomicU16::new(u16::MAX) }; 5];

/// Declares that a flight can do without the USB driver, whose interrupt `usb` has a lower priority than the motors'.
pub fn dispense_with(usb: impl InterruptNumber) {
    let [.., last] = &DISPENSABLE;
    last.store(usb.number(), Ordering::Relaxed);
}

/// Returns the spawner of the housekeeping executor.
///
/// # Panics
/// If the executor has not been started.
pub fn housekeeping() -> SendSpawner {
    HOUSEKEEPING.spawner()
}

/// Returns the token of a task to spawn.
///
/// # Panics
/// If the task has been spawned before.
pub fn once<S>(task: Result<SpawnToken<S>, SpawnError>) -> SpawnToken<S> {
    // The function is not inlined, so that all tasks share one panic message.
    #[cold]
    #[inline(never)]
    fn again() -> ! {
        panic!("a task is spawned twice")
    }
    task.unwrap_or_else(|_| again())
}

/// True if called from a task that a flight can do without.
pub fn in_dispensable_task() -> bool {
    match SCB::vect_active() {
        VectActive::Interrupt { irqn } => DISPENSABLE.iter().any(|line| line.load(Ordering::Relaxed) == irqn.into()),
        _ => false,
    }
}

/// Spawners of the executors.
#[expect(missing_docs, reason = "named after the module whose tasks each takes")]
pub struct Executors {
    /// None on a board without sensors.
    pub sampling: Option<SendSpawner>,
    /// None on a board without slow sensors.
    pub aiding: Option<SendSpawner>,
    pub control: SendSpawner,
    pub comms: SendSpawner,
    pub housekeeping: SendSpawner,
    /// None on a board that keeps no log.
    pub logging: Option<SendSpawner>,
}

/// Returns the spawner of the current executor, for tasks that are not `Send`. Must be called from a task.
#[expect(unsafe_code, reason = "an interrupt executor has no other spawner for tasks that are not Send")]
pub async fn spawner() -> Spawner {
    // SAFETY: this future is polled by an executor, since every task of this program is.
    unsafe { Spawner::for_current_executor() }.await
}

/// The interrupt lines of the executors, each named after the module whose tasks it takes.
#[expect(missing_docs, reason = "as above")]
pub struct InterruptLines<I> {
    pub control: I,
    pub comms: I,
    pub housekeeping: I,
    /// None on a board without sensors.
    pub sampling: Option<I>,
    /// None on a board without slow sensors.
    pub aiding: Option<I>,
    /// None on a board that keeps no log.
    pub logging: Option<I>,
}

/// Starts the executors and sets the priority of the time base. Must be called once.
#[expect(unsafe_code, reason = "priorities are set by hand")]
pub(crate) fn start<I: InterruptNumber>(core: &mut cortex_m::Peripherals, lines: InterruptLines<I>) -> Executors {
    let InterruptLines { control, comms, housekeeping, sampling, aiding, logging } = lines;
    // Sampling and control are not in this list, because no flight goes on without them: a panic there must stop the
    // motors.
    let dispensable = [Some(comms), Some(housekeeping), aiding, logging];
    for (line, dispensable) in dispensable.into_iter().flatten().zip(&DISPENSABLE) {
        dispensable.store(line.number(), Ordering::Relaxed);
    }
    let all = [
        (sampling, priority::SAMPLING),
        (Some(control), priority::CONTROL),
        (aiding, priority::AIDING),
        (Some(comms), priority::COMMS),
        (Some(housekeeping), priority::HOUSEKEEPING),
        (logging, priority::LOGGING),
    ];
    // SAFETY: none of these interrupts runs yet, and no critical section relies on a priority.
    unsafe {
        core.SCB.set_priority(SystemHandler::SysTick, priority::TIME);
        for (line, priority) in all {
            if let Some(line) = line {
                core.NVIC.set_priority(line, priority);
            }
        }
    }
    Executors {
        sampling: sampling.map(|line| SAMPLING.start(line)),
        control: CONTROL.start(control),
        aiding: aiding.map(|line| AIDING.start(line)),
        comms: COMMS.start(comms),
        housekeeping: HOUSEKEEPING.start(housekeeping),
        logging: logging.map(|line| LOGGING.start(line)),
    }
}

/// Polls the control executor.
///
/// # Safety
/// Must be called only by the interrupt that the executor was started with.
#[expect(unsafe_code, reason = "an executor must be polled from its own interrupt")]
pub unsafe fn on_control() {
    // SAFETY: guaranteed by the caller; `start` enables the interrupt.
    unsafe { CONTROL.on_interrupt() }
}

/// Polls the sampling executor.
///
/// # Safety
/// As for [`on_control`].
#[expect(unsafe_code, reason = "an executor must be polled from its own interrupt")]
pub unsafe fn on_sampling() {
    // SAFETY: as for `on_control`.
    unsafe { SAMPLING.on_interrupt() }
}

/// Polls the executor of slow sensors.
///
/// # Safety
/// As for [`on_control`].
#[expect(unsafe_code, reason = "an executor must be polled from its own interrupt")]
pub unsafe fn on_aiding() {
    // SAFETY: as for `on_control`.
    unsafe { AIDING.on_interrupt() }
}

/// Polls the link task's executor.
///
/// # Safety
/// As for [`on_control`].
#[expect(unsafe_code, reason = "an executor must be polled from its own interrupt")]
pub unsafe fn on_comms() {
    // SAFETY: as for `on_control`.
    unsafe { COMMS.on_interrupt() }
}

/// Polls the housekeeping executor.
///
/// # Safety
/// As for [`on_control`].
#[expect(unsafe_code, reason = "an executor must be polled from its own interrupt")]
pub unsafe fn on_housekeeping() {
    // SAFETY: as for `on_control`.
    unsafe { HOUSEKEEPING.on_interrupt() }
}

/// Polls the logging executor.
///
/// # Safety
/// As for [`on_control`].
#[expect(unsafe_code, reason = "an executor must be polled from its own interrupt")]
pub unsafe fn on_logging() {
    // SAFETY: as for `on_control`.
    unsafe { LOGGING.on_interrupt() }
}

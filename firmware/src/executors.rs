//! Three interrupt executors, and the priorities of all interrupts.
//!
//! The executors use the interrupt lines of CAN2, which this firmware does not need.

use cortex_m::peripheral::SCB;
use cortex_m::peripheral::scb::{SystemHandler, VectActive};
use embassy_executor::{InterruptExecutor, SendSpawner};
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::{InterruptExt, Priority};

/// Interrupt priorities; lower numbers preempt higher ones. The chip has sixteen.
pub mod priority {
    use super::Priority;
    /// SysTick: [`crate::time`].
    pub const TIME: Priority = Priority::P1;
    /// Bytes of USART1.
    pub const UART: Priority = Priority::P2;
    /// [`crate::control`].
    pub const CONTROL: Priority = Priority::P4;
    /// End of the motors' DMA transfer.
    pub const MOTOR_DMA: Priority = Priority::P6;
    /// [`crate::comms`].
    pub const COMMS: Priority = Priority::P8;
    /// [`crate::housekeeping`].
    pub const HOUSEKEEPING: Priority = Priority::P12;
}

static CONTROL: InterruptExecutor = InterruptExecutor::new();
static COMMS: InterruptExecutor = InterruptExecutor::new();
static HOUSEKEEPING: InterruptExecutor = InterruptExecutor::new();

/// True in a task that is not needed in flight: the link's, and housekeeping.
pub fn in_dispensable_task() -> bool {
    let dispensable = [interrupt::CAN2_RX0, interrupt::CAN2_RX1];
    match SCB::vect_active() {
        VectActive::Interrupt { irqn } => dispensable.into_iter().any(|line| line as u16 == irqn.into()),
        _ => false,
    }
}

/// Spawners of the executors.
#[expect(missing_docs, reason = "named after the module whose tasks each takes")]
pub struct Executors {
    pub control: SendSpawner,
    pub comms: SendSpawner,
    pub housekeeping: SendSpawner,
}

/// Starts the executors and sets the time base's priority. To be called once.
#[expect(unsafe_code, reason = "priorities are set by hand")]
pub fn start(core: &mut cortex_m::Peripherals) -> Executors {
    // SAFETY: SysTick is not running yet, and no critical section relies on its priority.
    unsafe { core.SCB.set_priority(SystemHandler::SysTick, priority::TIME.into()) };
    interrupt::CAN2_TX.set_priority(priority::CONTROL);
    interrupt::CAN2_RX0.set_priority(priority::COMMS);
    interrupt::CAN2_RX1.set_priority(priority::HOUSEKEEPING);
    Executors {
        control: CONTROL.start(interrupt::CAN2_TX),
        comms: COMMS.start(interrupt::CAN2_RX0),
        housekeeping: HOUSEKEEPING.start(interrupt::CAN2_RX1),
    }
}

#[interrupt]
#[allow(unsafe_code, reason = "the executor must be polled from its own interrupt")]
fn CAN2_TX() {
    // SAFETY: this is the handler of the interrupt that CONTROL was started with, and start() enables it.
    unsafe { CONTROL.on_interrupt() }
}

#[interrupt]
#[allow(unsafe_code, reason = "the executor must be polled from its own interrupt")]
fn CAN2_RX0() {
    // SAFETY: as for CAN2_TX, with COMMS.
    unsafe { COMMS.on_interrupt() }
}

#[interrupt]
#[allow(unsafe_code, reason = "the executor must be polled from its own interrupt")]
fn CAN2_RX1() {
    // SAFETY: as for CAN2_TX, with HOUSEKEEPING.
    unsafe { HOUSEKEEPING.on_interrupt() }
}

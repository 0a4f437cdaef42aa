//! AFBC on an STM32F405 at 168 MHz: a thin shell around [`afbc_flight_core`] and [`afbc_onboard`], which hold all
//! logic.
//!
//! # One firmware, an image per board
//!
//! The differences between boards are behind the trait [`board::Board`]; each crate in `boards/` implements it and
//! builds an image. `boards/stm32f405` is the one that flies. `boards/emulated` has the same control tick, link,
//! supervisor, executors and time base, but exchanges bytes with the host once per control tick, so that an emulator
//! can fly it in lockstep.
//!
//! # Priorities
//!
//! Nothing runs in thread mode: every task is in an interrupt executor, and the core idles otherwise. From the highest
//! priority (see [`executors::priority`]):
//!
//! | | runs | duration |
//! |---|---|---|
//! | 1 | SysTick: the time base, starts the control tick | 1 us per millisecond |
//! | 2 | USART1: bytes to and from their rings | 1 us per byte |
//! | 4 | [`control`]: the control tick, then the motors' waveform | 50 us per millisecond |
//! | 6 | end of the motors' DMA | 1 us per millisecond |
//! | 8 | [`comms`]: the link's messages | |
//! | 12 | [`housekeeping`]: logging, stack monitoring; [`parameters`]: writing to flash | |
//!
//! USART1 precedes the control tick because it buffers one byte, and the next comes within 11 us.
#![no_std]

pub mod board;
pub mod comms;
pub mod control;
pub mod executors;
pub mod housekeeping;
mod image;
pub mod parameters;
pub mod ticks;
pub mod time;
pub mod vehicle;

use board::{Board, Transmitter as _};
use embassy_executor::SendSpawner;

/// Starts everything; the core then idles between interrupts. `control`, `comms` and `keeper` start the tasks that use
/// the board; [`image!`] defines them.
pub fn run<B: Board>(
    mut core: cortex_m::Peripherals,
    control: impl FnOnce(SendSpawner, &'static mut vehicle::Flight, B),
    comms: impl FnOnce(SendSpawner, &'static mut comms::Desk, B::Receiver, B::Transmitter),
    keeper: impl FnOnce(SendSpawner, parameters::Keeper<B::Memory>),
) -> ! {
    let executors = executors::start(&mut core);
    let (mut board, receiver, mut transmitter, memory) = B::start(executors.control);
    let (kept, table) = parameters::read(memory, B::STORE);
    // In range: a whole number.
    transmitter.set_baud(table.configuration().link.baud);
    let flight = control::make(table.configuration());
    let desk = comms::make(table);
    board.unleash_watchdog();
    time::start(core.SYST);
    comms(executors.comms, desk, receiver, transmitter);
    control(executors.control, flight, board);
    keeper(executors.housekeeping, kept);
    housekeeping::spawn(executors.housekeeping);
    loop {
        B::idle();
    }
}

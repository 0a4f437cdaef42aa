//! AFBC on an STM32F405 at 168 MHz: a thin shell around [`afbc_flight_core`] and [`afbc_onboard`], which decide everything.
//!
//! # One firmware, an image per board
//!
//! What differs from board to board is behind the trait [`board::Board`]; each folder of `boards/` implements it and is an
//! image. `boards/stm32f405` is what flies. `boards/emulated` is the same control tick, link, supervisor, executors and time
//! base on a board that trades bytes with the host once per control tick, so that an emulator can fly it in lockstep.
//!
//! # Priorities
//!
//! Nothing runs in thread mode: every task lives in an interrupt executor, and the core idles when none has work.
//! From the most urgent (see [`executors::priority`]):
//!
//! | | runs | for about |
//! |---|---|---|
//! | 1 | SysTick: the time base, starts the control tick | 1 us a millisecond |
//! | 2 | USART1: bytes to and from their rings | 1 us a byte |
//! | 4 | [`control`]: the control tick, then the motors' waveform | 50 us a millisecond |
//! | 6 | the motors' DMA is done | 1 us a millisecond |
//! | 8 | [`comms`]: the link's messages | |
//! | 12 | [`housekeeping`]: logging, stack watch | |
//!
//! USART1 comes before the control tick because it holds one byte, and the next comes within 11 us.
#![no_std]

pub mod board;
pub mod comms;
pub mod control;
pub mod executors;
pub mod housekeeping;
pub mod time;

use board::Board;
use embassy_executor::SendSpawner;

/// Starts everything; the core then idles between interrupts. `control` and `comms` start the tasks that work on the board:
/// [`image!`] has them.
pub fn run<B: Board>(
    mut core: cortex_m::Peripherals,
    control: impl FnOnce(SendSpawner, B),
    comms: impl FnOnce(SendSpawner, B::Receiver, B::Transmitter),
) -> ! {
    let executors = executors::start(&mut core);
    let (board, receiver, transmitter) = B::start(executors.control);
    time::start(core.SYST);
    comms(executors.comms, receiver, transmitter);
    control(executors.control, board);
    housekeeping::spawn(executors.housekeeping);
    loop {
        B::idle();
    }
}

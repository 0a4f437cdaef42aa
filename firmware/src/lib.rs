//! AFBC on an STM32F405RG at 168 MHz: a thin shell around [`afbc_flight_core`] and [`afbc_link`], which decide everything.
//!
//! # Two images, one code
//!
//! `flight` is what flies. `pil` is the same control tick, link, supervisor, executors and time base, with another
//! [`board`]: it trades bytes with the host once a control tick, so that an emulator can fly it in lockstep.
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

#[cfg(not(feature = "pil"))]
pub mod clocks;
pub mod comms;
pub mod control;
pub mod executors;
pub mod housekeeping;
#[cfg(not(feature = "pil"))]
pub mod reset;
pub mod time;

#[cfg_attr(feature = "pil", path = "board/pil.rs")]
#[cfg_attr(not(feature = "pil"), path = "board/flight.rs")]
pub mod board;

/// Starts everything; the core then idles between interrupts.
pub fn run(mut core: cortex_m::Peripherals) -> ! {
    let executors = executors::start(&mut core);
    let board = board::start(executors.control);
    time::start(core.SYST);
    comms::spawn(executors.comms, board.receiver, board.transmitter);
    control::spawn(executors.control, board.outputs);
    housekeeping::spawn(executors.housekeeping);
    loop {
        board::idle();
    }
}

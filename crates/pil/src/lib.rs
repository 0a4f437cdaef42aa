//! Processor in the loop: runs the firmware's images on an emulated Cortex-M4F, from the host.
//!
//! QEMU executes the target's machine code, FPU included, but does not emulate the chip exactly:
//!
//! * It counts instructions (`-icount`), not cycles. Every count here is of instructions.
//! * It has no DMA, no timer outputs, no clock tree and no sensors, and peripherals answer at once.
//!
//! There are two images and two ways to run them:
//!
//! * [`Emulator`] flies the `pil` image in lockstep: one [exchange](Emulator::exchange) of bytes is one control tick.
//!   Time stops while the host computes, so every run gives the same bytes. [`LockstepPair`] compares them with the
//!   host's.
//! * [`EmulatedBoard`] boots the unmodified `flight` image and talks to its USART1. A [debugger](gdb) supplies the
//!   status bits of the clock tree, which the emulator lacks.
//!
//! ```no_run
//! use pil::{Emulator, FirmwareImage};
//!
//! let mut emulator = Emulator::start(&FirmwareImage::Pil.build(None)?)?;
//! let reply = emulator.exchange(b"MAVLink in")?;
//! println!("{} instructions, {} bytes out", reply.instructions, reply.bytes.len());
//! # Ok::<(), pil::Error>(())
//! ```
#![forbid(unsafe_code)]

pub mod background;
mod board;
pub mod budget;
pub mod clock_tree;
mod emulator;
mod error;
pub mod exercise;
pub mod gdb;
mod image;
mod lockstep;
mod qemu;
pub mod response;
pub mod timing;
pub mod worst_tick;

pub use board::EmulatedBoard;
pub use emulator::{Emulator, TickReply};
pub use error::Error;
pub use image::FirmwareImage;
pub use lockstep::{LockstepComparison, LockstepPair};

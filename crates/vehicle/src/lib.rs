//! The flight core around the law: who may fly, on what, and when the motors stop.
//!
//! Frames and units are stated in [`airframe`]. Everything that decides anything in flight is here and runs on the
//! host; firmware and simulator are shells that fill an [`Inbox`], call [`Vehicle::tick`] every millisecond and carry
//! its [`Outcome`] away.
//!
//! # Reading order
//!
//! 1. [`tick`]: the control tick on one page.
//! 2. [`supervisor`]: the four modes and what leads from one to another.
//! 3. [`inbox`]: what a tick works from, and how old it is.
//! 4. [`blind`]: what the vehicle does without a measurement; [`descent`]: how it comes down with one.
//! 5. [`rate`]: whether ticks come 1000 times a second.
//! 6. [`motor`], [`dshot`]: rotor speed to throttle to the waveform on the wire.
#![no_std]

pub mod blind;
pub mod descent;
pub mod dshot;
pub mod inbox;
pub mod motor;
pub mod rate;
pub mod supervisor;
pub mod tick;

pub use inbox::{Inbox, SourceClock, Stamped};
pub use motor::Motor;
pub use supervisor::{ArmingLimits, Mode, Refusal, Request};
pub use tick::{Health, Memory, Outcome, Vehicle};

//! The flight core around the law: who may fly, on what, and when the motors stop.
//!
//! Frames and units are stated in [`afbc_types`]. Everything that decides anything in flight is here and runs on the
//! host; firmware and simulator are shells that fill an [`Inbox`], call [`Vehicle::tick`] every millisecond and carry
//! its [`Outcome`] away.
//!
//! # Reading order
//!
//! 1. [`tick`]: the control tick on one page.
//! 2. [`supervisor`]: the four modes and what leads from one to another.
//! 3. [`inbox`]: what a tick works from, and how old it is; [`tracker`], [`clock`]: whose states those are, and when they
//!    were measured.
//! 4. [`landing`], [`tumble`], [`witness`]: whether the vehicle stands, has tipped over, or is not what its tracker says.
//! 5. [`blind`]: what the vehicle does without a measurement; [`descent`]: how it comes down with one.
//! 6. [`rate`]: whether ticks come 1000 times a second.
//! 7. [`motor`], [`dshot`]: rotor speed to throttle to the waveform on the wire.
#![no_std]

pub mod blind;
pub mod clock;
pub mod descent;
pub mod dshot;
pub mod inbox;
pub mod landing;
pub mod motor;
pub mod rate;
pub mod supervisor;
pub mod tick;
pub mod tracker;
pub mod tumble;
pub mod witness;

pub use clock::SourceClock;
pub use inbox::{Asked, Inbox, Stamped};
pub use motor::Motor;
pub use supervisor::{ArmingLimits, End, Mode, Refusal, Request};
pub use tick::{Answer, Health, Memory, Outcome, Vehicle};
pub use tracker::Tracker;

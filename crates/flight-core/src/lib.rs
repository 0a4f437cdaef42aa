//! The flight core around a control law: arming, failsafes, and motor gating.
//!
//! [`afbc_types`] defines frames and units. This crate makes all decisions in flight, and runs on the host too.
//! Firmware and simulator are shells that fill an [`Inbox`], call [`FlightCore::tick`] every millisecond and output its
//! [`TickOutcome`].
//!
//! # Reading order
//!
//! 1. [`tick`]: the control tick; [`memory`]: the memory between ticks.
//! 2. [`supervisor`]: the four modes and their transitions; [`refusal`], [`reasons`]: reasons for refusing requests and
//!    arming.
//! 3. [`inbox`]: the inputs of a tick and their ages; [`tracker`], [`clock`]: selection of states, and the times of
//!    their measurement.
//! 4. [`landing`], [`tumble`], [`frozen_tracker`]: detection of landing, tumbling and frozen trackers.
//! 5. [`dead_reckoning`]: flight without measurements; [`observer`]: flight on poses alone; [`descent`]: descent with
//!    measurements.
//! 6. [`rate`]: supervision of the tick rate.
//! 7. [`motor`]: throttle curve; [`protocol`]: output to the motor controllers by [`dshot`] or [`pulse`], and their
//!    replies by [`dshot_reply`].
#![no_std]

mod armed;
pub mod clock;
pub mod dead_reckoning;
pub mod descent;
pub mod dshot;
pub mod dshot_reply;
pub mod fall_check;
pub mod frozen_tracker;
pub mod inbox;
pub mod landing;
pub mod memory;
pub mod motor;
pub mod numbering;
pub mod observer;
pub mod protocol;
pub mod pulse;
pub mod rate;
pub mod rate_control;
pub mod reasons;
pub mod refusal;
pub mod supervisor;
pub mod tick;
pub mod timer_clock;
pub mod tracker;
pub mod tumble;

pub use afbc_types::Stamped;
pub use clock::SourceClock;
pub use inbox::{Inbox, Queue, Ticketed};
pub use memory::FlightCoreMemory;
pub use motor::Motor;
pub use rate_control::RateTarget;
pub use reasons::Reasons;
pub use supervisor::{ArmingLimits, EndReason, Mode, Refusal, Request};
pub use tick::{FlightCore, RequestAnswer, TickHealth, TickOutcome};
pub use tracker::Tracker;

#[cfg(test)]
mod tests;

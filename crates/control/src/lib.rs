//! What every quadrotor controller shares: the interface that harness, flight core and firmware fly it by, and what it
//! is built from.
//!
//! Frames, units and the meaning of "(n)" are stated in [`afbc_types`].
//!
//! * [`FlightController`]: a step from state and setpoint to an [`Action`]; a [`Trace`] of why. Laws are in other crates,
//!   `afbc` and `afbc-peers`; a law of one's own needs this crate only.
//! * [`Screened`]: the memory of a controller that implausible input does not reach.
//! * [`mixer`]: U1..U4 to rotor forces and speeds, and back.
//! * [`command_filter`]: a smooth reference with two derivatives.
//! * [`math`]: where every transcendental function comes from; the same bits on host and target.
//!
//! Features `serde` and `defmt`, off by default, are those of [`afbc_types`]; here they add actions, health and traces.
#![no_std]

mod action;
pub mod command_filter;
mod controller;
pub mod math;
pub mod mixer;
mod screen;
pub mod settings;
mod trace;
mod trip;

pub use action::{Action, Health};
pub use controller::FlightController;
pub use mixer::Mixer;
pub use nalgebra;
pub use screen::{Screen, Screened};
pub use settings::Settings;
pub use trace::{Errors, Estimate, Trace};
pub use trip::Trip;

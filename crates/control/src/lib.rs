//! Common parts of all quadrotor controllers: the interface to harness, flight core and firmware, and building blocks.
//!
//! Frames, units and the meaning of "(n)" are defined in [`afbc_types`].
//!
//! * [`FlightController`]: a step from state and setpoint to an [`Action`], and a [`Trace`] of its internal signals.
//!   Control laws are in the crates `afbc` and `afbc-laws`. A new law needs only this crate.
//! * [`Validated`]: a controller's memory behind a screen that rejects implausible inputs.
//! * [`mixer`]: control allocation, from U1..U4 to rotor forces and speeds, and back.
//! * [`command_filter`]: a smooth reference with two derivatives.
//! * [`drag`]: known drag, for laws that compensate it.
//! * [`smoothing`]: low-pass filters on the inputs.
//! * [`math`]: all transcendental functions, with bit-identical results on host and target.
//!
//! The features `serde` and `defmt`, off by default, are those of [`afbc_types`], and also cover actions, health and
//! traces.
#![no_std]

mod action;
pub mod command_filter;
mod controller;
pub mod drag;
pub mod math;
pub mod mixer;
mod screen;
pub mod settings;
pub mod smoothing;
mod trace;

pub use action::{Action, Health};
pub use controller::FlightController;
pub use mixer::Mixer;
pub use nalgebra;
pub use screen::{Screen, Validated};
pub use settings::Settings;
pub use smoothing::{Smoothed, Smoother, Smoothing};
pub use trace::{Errors, Trace};

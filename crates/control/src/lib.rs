//! Parts shared by all quadrotor controllers: the interface between controller and harness, flight core or firmware,
//! and the building blocks of controllers.
//!
//! Frames, units and the meaning of "(n)" are defined in [`afbc_types`].
//!
//! * [`FlightController`]: a step from state and setpoint to an [`Action`], and a [`Trace`] of its internal signals.
//!   Control laws are in the crates `afbc` and `afbc-peers`; a new law needs this crate only.
//! * [`Validated`]: a controller's memory behind a screen that rejects implausible input.
//! * [`mixer`]: control allocation, from U1..U4 to rotor forces and speeds, and back.
//! * [`command_filter`]: a smooth reference with two derivatives.
//! * [`drag`]: what is known of drag, for laws that make up for it.
//! * [`smoothing`]: low-pass filters on the inputs.
//! * [`math`]: all transcendental functions, with bit-identical results on host and target.
//!
//! Features `serde` and `defmt`, off by default, are those of [`afbc_types`]; here they also cover actions, health
//! and traces.
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

//! The vehicle's physics, in `f64`. Knows no controller: rotor speeds go in, motion comes out.
//!
//! Two models of one vehicle: [`simplified`], the paper's (6), and [`rigid_body`], its (1)-(5) as corrected. Both take
//! gusts and parameters that change in time from an [`Environment`], and both are integrated by the classical
//! fourth-order Runge-Kutta method with the rotor speeds held over the step.
//!
//! Frames, units and the meaning of "(n)" are stated in [`airframe`]. Trigonometry comes from the `libm` crate, so a
//! flight gives the same bits on every host.
//!
//! ```
//! use airframe::{Parameters, RotorSpeeds};
//! use plant::{Environment, Model, Motion, Plant};
//!
//! let environment = Environment::calm(Parameters::PAPER)?;
//! let mut plant = Plant::new(Model::RigidBody, Motion::default(), environment);
//! for _ in 0..1000 {
//!     plant.step(&RotorSpeeds::default(), 0.001);
//! }
//! assert!((plant.motion().velocity_m_s.z + 9.81).abs() < 1e-9); // one second of free fall
//! # Ok::<(), airframe::OutOfRange>(())
//! ```
#![no_std]

extern crate alloc;

mod environment;
pub mod integrate;
mod motion;
pub mod rigid_body;
pub mod simplified;
mod vehicle;

pub use environment::{Environment, GUST_SIZE, Gust, GustKind, ParameterChange, Quantity, START};
pub use motion::Motion;
pub use vehicle::{Load, Model, Plant};

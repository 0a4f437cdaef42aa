//! Established quadrotor controllers for comparison with AFBC, under the same constraints (no_std, no alloc, fixed
//! size) and behind the same interface, [`FlightController`](afbc_control::FlightController).
//!
//! | controller | description | source |
//! |---|---|---|
//! | [`pid`] | cascaded PID with a tilt-prioritised attitude loop | PX4; Brescianini and D'Andrea 2018 |
//! | [`geometric`] | tracking on SE(3), optionally with integrals | Lee, Leok, McClamroch 2010; Goodarzi et al. 2013 |
//! | [`indi`] | incremental dynamic inversion of attitude and position | Smeur et al. 2016, 2018; Tal, Karaman 2021 |
//! | [`l1`] | geometric, with L1-adaptive compensation of thrust and moments | Wu et al. 2022, 2025 |
//! | [`dfbc`] | differential flatness, incremental inversion of the moments | Sun et al. 2022 |
//! | [`mpc`] | linear model-predictive control, by ADMM | Kamel et al. 2017; TinyMPC, 2024 |
//!
//! The head of each file gives the equations, the sources, and the decisions where a source leaves something open.
//! [`afbc_types`] defines frames and units.
//!
//! # Common to all
//!
//! * Interface: an [`afbc_types::State`] and an [`afbc_types::Setpoint`] in, an [`afbc_control::Action`] out. All
//!   compute U1..U4 and use the same [`Mixer`](afbc_control::Mixer), so that no controller has a better allocation than
//!   another.
//! * [`afbc_control::Settings`]: time step and rotor limit.
//! * Implausible input is rejected by [`afbc_control::Screen`]; filters and integrators do not advance on a repeated
//!   state.
//! * Nominal mass and inertia scale everything, so gains are in 1/s and 1/s2 and suit vehicles of any size with the
//!   same rotor lag.
//! * [`limits::SpecificForceLimits`]: thrust within what the rotors give, and tilt below a maximum.
//! * All mathematics is from [`afbc_control::math`], bit-identical on host and target. Its sine is off by up to 1.7e-4,
//!   so a tilt of 0.1 rad becomes 0.0998. Without an integral this causes a steady-state error of at most 0.002 m/s2,
//!   with an integral none.
//!
//! # Tuning
//!
//! Gains are plain structs, declared with their ranges. The tuner searches those marked `tuned`; the others describe
//! the vehicle and its task (largest tilt, rotor lag). All gain sets here are for the vehicle of the paper's Section IV
//! with a rotor lag of 20 ms. `Gains::PAPER_VEHICLE` and sets named after their source are hand-tuned; `sitl tune`
//! found `Gains::TUNED` (`docs/tuning.md`).
//!
//! ```
//! use afbc_control::{FlightController, Validated, Settings};
//! use afbc_types::{Parameters, Setpoint, State};
//! use afbc_laws::pid::{Gains, Pid};
//!
//! let settings = Settings { rotor_force_max_n: 3.0, ..Settings::DEFAULT };
//! let controller = Pid::new(Parameters::PAPER.to_f32(), settings, Gains::PAPER_VEHICLE)?;
//! let action = controller.step(&mut Validated::default(), Some(&State::default()), &Setpoint::default());
//! assert!((action.forces.0.sum() - 0.486 * 9.81).abs() < 1e-5); // nothing to correct: the weight
//! # Ok::<(), afbc_types::OutOfRange>(())
//! ```
#![no_std]

pub mod attitude;
mod body;
pub mod dfbc;
pub mod differentiator;
mod flat_attitude;
pub mod flatness;
pub mod geometric;
mod hover_thrust;
mod increment;
pub mod indi;
mod integral;
pub mod l1;
pub mod limits;
mod loops;
pub mod mpc;
pub mod pid;
mod rotor_model;
mod slowed;

pub use dfbc::Dfbc;
pub use geometric::Geometric;
pub use indi::Indi;
pub use l1::L1;
pub use mpc::Mpc;
pub use pid::Pid;
pub use slowed::slowed;

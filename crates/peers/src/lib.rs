//! Established quadrotor controllers, for AFBC to be weighed against, in AFBC's own style: no_std, no alloc, fixed size,
//! and behind the same [`FlightController`](afbc_control::FlightController).
//!
//! | controller | what it is | source |
//! |---|---|---|
//! | [`pid`] | cascaded PID with a tilt-prioritised attitude loop, as autopilots fly | PX4; Brescianini and D'Andrea 2018 |
//! | [`geometric`] | tracking on SE(3), optionally with integral terms | Lee, Leok, McClamroch 2010; Goodarzi, Lee, Leok 2013 |
//! | [`indi`] | incremental dynamic inversion of attitude and of position | Smeur, Chu, de Croon 2016 and 2018 |
//!
//! Each has its equations and its sources at the top of its file; where the source leaves something open, the same
//! place says what was decided. Frames and units are stated in [`afbc_types`].
//!
//! # What they share
//!
//! * The interface: an [`afbc_types::State`] and an [`afbc_types::Setpoint`] in, an [`afbc_control::Action`] out, by
//!   way of U1..U4 and the one [`Mixer`](afbc_control::Mixer), so that no controller has a better allocation than
//!   another.
//! * [`afbc_control::Settings`]: the time step and the rotors' limit.
//! * Implausible input through [`afbc_control::Screen`]; filters and integrators rest while the state is not a new one.
//! * The vehicle's nominal parameters scale everything, so gains are in 1/s and 1/s2 and serve vehicles of any size whose
//!   rotors are as quick.
//! * [`limits::Limits`]: thrust within what the rotors give, tilt below a maximum, yaw no dearer than it is worth.
//! * Mathematics from [`afbc_control::math`] alone, so host and target give the same bits. Its sine is off by up to
//!   1.2e-3, which turns a tilt of 0.1 rad into 0.0987: a lasting 0.013 m/s2 at most where nothing integrates, and
//!   nothing elsewhere.
//!
//! # Tuning
//!
//! Gains are plain structs, declared with their ranges. The tuner searches those that are a matter of taste (`tuned`);
//! the others describe the vehicle and its task (largest tilt, rotor lag). The sets given here are for the vehicle of
//! the paper's Section IV with rotors of 20 ms: those named `Gains::PAPER_VEHICLE` or after their source were tuned by
//! hand, `Gains::TUNED` by `sitl tune` (`docs/tuning.md`).
//!
//! ```
//! use afbc_control::{FlightController, Screened, Settings};
//! use afbc_types::{Parameters, Setpoint, State};
//! use afbc_peers::pid::{Gains, Pid};
//!
//! let settings = Settings { dt_s: 0.001, rotor_force_max_n: 3.0 };
//! let controller = Pid::new(Parameters::PAPER.to_f32(), settings, Gains::PAPER_VEHICLE)?;
//! let action = controller.step(&mut Screened::default(), Some(&State::default()), &Setpoint::default());
//! assert!((action.forces.0.sum() - 0.486 * 9.81).abs() < 1e-5); // nothing to correct: the weight
//! # Ok::<(), afbc_types::OutOfRange>(())
//! ```
#![no_std]

pub mod attitude;
mod body;
pub mod differentiator;
pub mod geometric;
pub mod indi;
mod integral;
pub mod limits;
mod loops;
pub mod pid;

pub use geometric::Geometric;
pub use indi::Indi;
pub use pid::Pid;

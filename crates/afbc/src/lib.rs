//! Adaptive fuzzy backstepping control (AFBC) of a quadrotor, after Yacef, Bouhali and Hamerlain, and the classical
//! backstepping law that it is compared with.
//!
//! Frames, units and the meaning of "(n)" are stated in [`afbc_types`]; corrections to the paper in `docs/paper.md`.
//!
//! # Reading order
//!
//! 1. [`fuzzy`]: nine rules from two inputs, (17)-(19).
//! 2. [`backstepping`]: the errors (9)-(13), the ideal law (16), the baseline controller (21).
//! 3. [`adaptive`]: the law (20)-(22) with its adaptation (32)-(34).
//! 4. [`law`]: what a law in the cascade is; [`cascade`]: six subsystems, the desired attitude (39)-(40) and the command
//!    filter make one [`Controller`], which is an [`afbc_control::FlightController`].
//! 5. [`safeguards`], [`limits`], [`standstill`]: what makes the printed law fit to fly, in [`Profile::Flight`].
//! 6. [`monitor`], [`integral`], [`guarded`]: who watches AFBC, and who flies when it is not to be trusted.
//!
//! # What to expect
//!
//! Parameters are checked once, by name, when a [`Controller`] is built. After that a step cannot fail, allocate or
//! panic, has no loop whose length depends on what it is given, and gives the same bits on host and target: all
//! mathematics comes from [`afbc_control::math`]. Which branches it takes, and so how long it takes, does depend on
//! its inputs: limits, projection, saturated rotors and the monitor cost what they do only where they act.
//!
//! ```
//! use afbc::{Adaptive, Controller, Profile};
//! use afbc_control::{FlightController, Screened};
//! use afbc_types::{Parameters, Setpoint, State};
//!
//! let vehicle = Parameters::PAPER.to_f32();
//! let controller = Controller::new(vehicle, Profile::Paper.settings(), Adaptive::new(Profile::Paper.gains())?)?;
//! let mut memory = Screened::default();
//! let mut above = Setpoint::default();
//! above.position_m.z = 1.0;
//! let action = controller.step(&mut memory, Some(&State::default()), &above);
//! assert!((action.forces.0.sum() - 18.0).abs() < 1e-5); // alpha_24 alpha_14 e_14 = 6 * 3 * 1 m
//! # Ok::<(), afbc_types::OutOfRange>(())
//! ```
#![no_std]

pub mod adaptive;
pub mod backstepping;
pub mod cascade;
pub mod fuzzy;
pub mod guarded;
pub mod integral;
pub mod law;
pub mod limits;
pub mod model;
pub mod monitor;
mod profile;
pub mod safeguards;
pub mod standstill;

pub use adaptive::Adaptive;
pub use backstepping::Backstepping;
pub use cascade::{Cascade, Controller, Settings};
pub use guarded::Guarded;
pub use law::Law;
pub use limits::Limits;
pub use profile::Profile;
pub use safeguards::Safeguards;

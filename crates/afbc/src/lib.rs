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
//! 4. [`cascade`]: six subsystems, the desired attitude (39)-(40) and the command filter make one [`Controller`].
//! 5. [`allocation`]: U1..U4 to rotor forces and speeds, and back.
//! 6. [`safeguards`], [`limits`], [`ground`]: what makes the printed law fit to fly, in [`Profile::Flight`].
//! 7. [`monitor`], [`integral`], [`guarded`]: who watches AFBC, and who flies when it is not to be trusted.
//!
//! # What to expect
//!
//! Parameters are checked once, by name, when a [`Controller`] is built. After that a step cannot fail, allocate or
//! panic, has no loop whose length depends on what it is given, and gives the same bits on host and target: all
//! mathematics comes from [`math`]. Which branches it takes, and so how long it takes, does depend on its inputs: limits,
//! projection, saturated rotors and the monitor cost what they do only where they act.
//!
//! ```
//! use afbc::{Adaptive, Controller, FlightController, Memory, Profile};
//! use afbc_types::{Parameters, Setpoint, State};
//!
//! let vehicle = Parameters::PAPER.to_f32();
//! let controller = Controller::new(vehicle, Profile::Paper.settings(), Adaptive::new(Profile::Paper.gains())?)?;
//! let mut memory = Memory::default();
//! let mut above = Setpoint::default();
//! above.position_m.z = 1.0;
//! let command = controller.step(&mut memory, &State::default(), &above);
//! assert!((command.inputs.thrust_n - 18.0).abs() < 1e-5); // alpha_24 alpha_14 e_14 = 6 * 3 * 1 m
//! # Ok::<(), afbc_types::OutOfRange>(())
//! ```
#![no_std]

pub mod adaptive;
pub mod allocation;
pub mod backstepping;
pub mod cascade;
pub mod command_filter;
mod flight_controller;
pub mod fuzzy;
pub mod ground;
pub mod guarded;
pub mod integral;
pub mod limits;
pub mod math;
pub mod model;
pub mod monitor;
mod profile;
pub mod safeguards;
mod screen;

pub use adaptive::Adaptive;
pub use backstepping::Backstepping;
pub use cascade::{Cascade, Command, Controller, Health, Law, Settings};
pub use flight_controller::{FlightController, Memory};
pub use guarded::Guarded;
pub use limits::Limits;
pub use profile::Profile;
pub use safeguards::Safeguards;
pub use screen::Screen;

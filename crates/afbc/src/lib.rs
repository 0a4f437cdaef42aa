//! Adaptive fuzzy backstepping control (AFBC) of a quadrotor, after Yacef, Bouhali and Hamerlain, and its baseline,
//! classical backstepping.
//!
//! [`afbc_types`] defines frames, units and the meaning of "(n)"; `docs/paper.md` lists corrections to the paper.
//!
//! # Reading order
//!
//! 1. [`fuzzy`]: nine rules from two inputs, (17)-(19).
//! 2. [`backstepping`]: the errors (9)-(13), the ideal law (16), the baseline controller (21).
//! 3. [`adaptive`]: the law (20)-(22) with its adaptation (32)-(34).
//! 4. [`law`]: interface of a law; [`cascade`]: six subsystems, the desired attitude (39)-(40) and the command filter
//!    form a [`Controller`], which is an [`afbc_control::FlightController`].
//! 5. [`safeguards`], [`limits`], [`standstill`]: additions for real flight, used in [`Profile::Flight`].
//! 6. [`monitor`], [`integral`], [`guarded`]: monitor and fallback law.
//!
//! # Properties
//!
//! Creating a [`Controller`] checks all parameters, and its errors name them. After that a step cannot fail, allocate
//! or panic. No loop depends on its inputs, and host and target give the same bits, because all mathematics comes from
//! [`afbc_control::math`]. The branches, and so the duration, depend on the inputs: limits, projection, saturated
//! rotors and the monitor take time only when they act.
//!
//! ```
//! use afbc::{Adaptive, Controller, Profile};
//! use afbc_control::{FlightController, Validated};
//! use afbc_types::{Parameters, Setpoint, State};
//!
//! let vehicle = Parameters::PAPER.to_f32();
//! let controller = Controller::new(vehicle, Profile::Paper.settings(), Adaptive::new(Profile::Paper.gains())?)?;
//! let mut memory = Validated::default();
//! let mut above = Setpoint::default();
//! above.position_m.z = 1.0;
//! let action = controller.step(&mut memory, Some(&State::default()), &above);
//! assert!((action.forces.0.sum() - 18.0).abs() < 1e-5); // alpha_24 alpha_14 e_14 = 6 * 3 * 1 m
//! # Ok::<(), afbc_types::OutOfRange>(())
//! ```
#![no_std]

pub mod adaptive;
pub mod age;
pub mod backstepping;
pub mod cascade;
pub mod delay_compensation;
pub mod desired;
pub mod disturbance;
pub mod effectiveness;
pub mod effort;
pub mod force_map;
pub mod fuzzy;
pub mod guarded;
pub mod integral;
pub mod jump_filter;
pub mod law;
pub mod limits;
pub mod model;
pub mod moments;
pub mod monitor;
mod profile;
pub mod reference;
pub mod rotation;
pub mod safeguards;
mod settings;
pub mod standstill;
pub mod tilt;
mod trip;

pub use adaptive::{Adaptive, AdaptiveEstimate};
pub use backstepping::Backstepping;
pub use cascade::{CascadeMemory, Controller, Settings};
pub use guarded::Guarded;
pub use law::SubsystemLaw;
pub use limits::PositionControlLimits;
pub use profile::{LAG_S, Profile, by_rule, slowness};
pub use safeguards::Safeguards;
pub use trip::Trip;

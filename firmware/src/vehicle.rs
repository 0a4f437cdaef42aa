//! The vehicle that this image flies, from its file: `VEHICLE=... cargo fw` ([`build.rs`](../../build.rs)).
//!
//! Which one it is, is decided when the image is built, and everything about it is checked there.

use afbc::adaptive::Gains;
use afbc::disturbance::DisturbanceObserver;
use afbc::fuzzy::Membership;
use afbc::reference::ReferenceModel;
use afbc::{Limits, Safeguards, Settings, backstepping};
use afbc_control::Smoothing;
use afbc_control::drag::KnownDrag;
use afbc_flight_core::motor::{Curve, Response};
use afbc_onboard::Estimation;
use afbc_types::{Airframe, Mounting, Parameters, PerAxis, Rotor};
use nalgebra::Vector3;

/// What the firmware is told of it.
pub type Configuration = afbc_onboard::Configuration<ROTORS>;
/// Its parameters, from which the configuration is made.
pub type ParameterTable = afbc_onboard::parameters::ParameterTable<ROTORS>;
/// A configuration ready to be flown.
pub type Prepared = afbc_onboard::Prepared<ROTORS>;
/// The vehicle under its law.
pub type Flight = afbc_onboard::Flight<ROTORS>;
/// What one of its ticks decided.
pub type Report = afbc_onboard::Report<ROTORS>;

include!(concat!(env!("OUT_DIR"), "/vehicle.rs"));

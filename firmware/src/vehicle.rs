//! The vehicle that this image flies, from its file: `VEHICLE=... cargo fw` ([`build.rs`](../../build.rs)).
//!
//! Which one it is, is decided when the image is built, and everything about it is checked there.

use afbc::adaptive::Gains;
use afbc::disturbance::DisturbanceObserver;
use afbc::fuzzy::Membership;
use afbc::reference::ReferenceModel;
use afbc::{Limits, Safeguards, Settings, backstepping};
use afbc_control::Smoothing;
use afbc_flight_core::motor::Curve;
use afbc_onboard::{Configuration, Estimation};
use afbc_types::{Airframe, Parameters, PerAxis, Rotor};
use nalgebra::Vector3;

include!(concat!(env!("OUT_DIR"), "/vehicle.rs"));

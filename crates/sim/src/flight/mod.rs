//! Flies in lockstep: each step measures, decides, observes and moves the vehicle.
//!
//! A [`World`] has the plant, its disturbances and its sensors. A vehicle with an IMU estimates its state with the
//! estimator that flies on board. A [`FlightSoftware`] reads the sensors and commands the rotors. It is a law
//! ([`LawOnly`]), the flight core with a law inside ([`InFlightCore`]), or the firmware at the other end of a link
//! (`afbc-hil`). [`lockstep`] is the loop around world and pilot.

mod contender;
mod estimation;
mod in_flight_core;
mod law_only;
mod lockstep;
mod loss;
mod pilot;
mod sample;
mod sensing;
mod sensor_model;
mod world;

pub use afbc_flight_core::Mode;
pub use contender::{FlightStart, fly, fly_until};
pub use estimation::{EstimateErrors, Innovation, REST_S};
pub use in_flight_core::InFlightCore;
pub use law_only::LawOnly;
pub use lockstep::{FlightEnd, Lost, lockstep};
pub use loss::{ALOFT_M, CLEAR_M, GROUNDED_S, LOST_DISTANCE_M, OFF_S};
pub use pilot::FlightSoftware;
pub use sample::Sample;
pub use sensing::{CARRIED_S, STANDS_S};
pub use world::{World, WorldView};

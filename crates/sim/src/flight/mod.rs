//! Lockstep flights: measure, decide, observe, move the vehicle, once per step.
//!
//! A [`World`] has the plant, its disturbances and its sensors; a vehicle with an inertial sensor estimates its state
//! itself, by the estimator that flies on board. A [`Pilot`] reads the sensors and commands the rotors:
//! a law [`Alone`], the flight core with a law inside ([`Aboard`]), or the firmware at the other end of a link
//! ([`crate::in_the_loop`]). [`lockstep`] is the loop around both.

mod aboard;
mod alone;
mod contender;
mod estimation;
mod lockstep;
mod loss;
mod pilot;
mod sample;
mod sensing;
mod told;
mod world;

pub use aboard::Aboard;
pub use alone::Alone;
pub use contender::fly;
pub use estimation::{CARRIED_S, Estimated, Innovation, REST_S};
pub use lockstep::{End, Lost, lockstep};
pub use loss::{ALOFT_M, CLEAR_M, GROUNDED_S, LOST_DISTANCE_M, OFF_S};
pub use pilot::Pilot;
pub use sample::Sample;
pub use sensing::STANDS_S;
pub use world::{View, World};

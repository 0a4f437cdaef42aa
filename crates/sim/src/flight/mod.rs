//! Lockstep flights: measure, decide, observe, move the vehicle, once per step.
//!
//! A [`World`] has the plant, its disturbances and its sensors. A [`Pilot`] reads the sensors and commands the rotors:
//! a law [`Alone`], the flight core with a law inside ([`Aboard`]), or the firmware at the other end of a link
//! ([`crate::in_the_loop`]). [`lockstep`] is the loop around both.

mod aboard;
mod alone;
mod contender;
mod lockstep;
mod pilot;
mod sample;
mod world;

pub use aboard::Aboard;
pub use alone::Alone;
pub use contender::fly;
pub use lockstep::{End, LOST_DISTANCE_M, Lost, lockstep};
pub use pilot::Pilot;
pub use sample::Sample;
pub use world::{View, World};

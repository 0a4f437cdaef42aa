//! Scenarios: one vehicle, one trajectory, one environment, and the contenders to compare.
//!
//! A scenario comes from [`paper`], from a file ([`load`]) or from the [`built_in()`] ones. A [`contender`] is a
//! control law of the list of laws with its gains. `afbc-sim` flies the scenarios.
#![forbid(unsafe_code)]

mod any_controller;
mod built_in;
pub mod case;
mod choice;
pub mod contender;
mod definition;
mod file;
mod flown_law;
mod laws;
pub mod paper;
mod told;
pub mod trajectory;
mod vehicle_named;

pub use built_in::{BUILT_IN, built_in, similar_built_in};
pub use definition::{DURATION, Outage, Scenario};
pub use file::{load, parse, read};
pub use flown_law::FlownLaw;
pub use laws::{
    AnyController, AnyControllerMemory, OWN_GAINS_MAX, OwnController, OwnFlight, OwnGain, OwnGains, OwnKind, OwnLaw,
    OwnMemory, OwnVehicle,
};
pub use told::AssumedInstruments;
pub use vehicle_named::{vehicle_named, vehicle_of};

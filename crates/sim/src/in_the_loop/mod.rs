//! Flights in which the autopilot is the firmware, or stands in for it: the plant here, the law there, and between them
//! nothing but the bytes of [`afbc_link`].
//!
//! # Reading order
//!
//! 1. [`Autopilot`]: what takes bytes and gives bytes, once a millisecond.
//! 2. [`Host`]: the firmware's code in this process. Other programs bring an emulated processor, or a board at the end of a
//!    serial port.
//! 3. [`Station`]: tracker, commander and listener in one, the other end of the link.
//! 4. [`fly()`]: arms, lets the vehicle go, flies a scenario, disarms. [`Pace`] is how often it speaks.
//!
//! The firmware holds the paper's vehicle and flies its own law ([`firmware`]); a scenario that wants others is refused
//! ([`check`]).
//! Everything around the vehicle is the scenario's: equations, gusts, true parameters, start, trajectory.

mod autopilot;
mod error;
mod extremes;
mod flight;
mod host;
mod log;
mod pace;
mod report;
mod station;

#[cfg(test)]
mod tests;

pub use autopilot::Autopilot;
pub use error::Error;
pub use extremes::Extremes;
pub use flight::{LoopEnd, check, firmware, fly};
pub use host::{Host, Tick};
pub use log::Log;
pub use pace::Pace;
pub use report::tracking;
pub use station::{Heard, Station};

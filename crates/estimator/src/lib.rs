//! State estimator of a multirotor.
#![no_std]

mod aid;
mod align;
mod covariance;
mod estimate;
mod estimator;
mod fusion;
mod geodetic;
mod history;
mod horizon;
mod imu;
mod measurement;
mod memory;
mod nominal;
mod queue;
mod restart;
mod rotation;
mod settings;

pub use aid::{Aid, AidRecord, Aids};
pub use align::Unready;
pub use estimate::{Dropped, Estimate, Resets, Sigmas, Validity};
pub use estimator::Estimator;
pub use geodetic::Origin;
pub use imu::{ImuHealth, MISSING_US};
pub use measurement::{ImuSample, Measurement, Timed};
pub use memory::Memory;
pub use settings::Settings;

#[cfg(test)]
mod tests;

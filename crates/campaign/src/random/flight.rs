//! A drawn flight.

use super::mismatch::ModelMismatch;
use afbc_scenario::Scenario;

/// Source of the state that the controllers see.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FeedbackSource {
    /// True state with the noise of the built-in scenario `hardware`.
    Truth,
    /// The vehicle's own estimate from the instruments of the built-in scenario `mocap`.
    Mocap,
    /// The vehicle's own estimate from the instruments of the built-in scenario `outdoor`.
    Outdoor,
}

impl FeedbackSource {
    /// Returns the name of the built-in scenario with these sensors.
    pub const fn scenario(self) -> &'static str {
        match self {
            FeedbackSource::Truth => "hardware",
            FeedbackSource::Mocap => "mocap",
            FeedbackSource::Outdoor => "outdoor",
        }
    }
}

/// A drawn flight.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnFlight {
    /// Seed that the flight was drawn from.
    pub seed: u64,
    /// Name of the vehicle.
    pub vehicle: String,
    /// Number among the seed's flights of the vehicle, from 1.
    pub number: u64,
    /// Kind of path.
    pub path: &'static str,
    /// True if the flight begins on the ground.
    pub stands: bool,
    /// Largest speed of the reference \[m/s\].
    pub speed_m_s: f64,
    /// Largest acceleration of the reference \[m/s2\].
    pub acceleration_m_s2: f64,
    /// Difference from the vehicle's file.
    pub change: ModelMismatch,
    /// Scenario to fly.
    pub scenario: Scenario,
}

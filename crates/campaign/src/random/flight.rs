//! A drawn flight.

use super::change::Change;
use afbc_scenario::Scenario;

/// What the controllers see.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seen {
    /// The truth with the noise of the built-in scenario `hardware`.
    Truth,
    /// The vehicle's own estimate, by the instruments of the built-in scenario `mocap`.
    Mocap,
    /// Likewise `outdoor`.
    Outdoor,
}

impl Seen {
    /// Name of the built-in scenario whose sensors it is.
    pub const fn scenario(self) -> &'static str {
        match self {
            Seen::Truth => "hardware",
            Seen::Mocap => "mocap",
            Seen::Outdoor => "outdoor",
        }
    }
}

/// A drawn flight.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnFlight {
    /// Seed that it was drawn from.
    pub seed: u64,
    /// Name of the vehicle.
    pub vehicle: String,
    /// Number among the seed's flights of the vehicle, from 1.
    pub number: u64,
    /// Kind of path.
    pub path: &'static str,
    /// Whether it begins on the ground.
    pub stands: bool,
    /// Largest speed of the reference \[m/s\].
    pub speed_m_s: f64,
    /// Largest acceleration of the reference \[m/s2\].
    pub acceleration_m_s2: f64,
    /// What the vehicle's file does not state.
    pub change: Change,
    /// The flight.
    pub scenario: Scenario,
}

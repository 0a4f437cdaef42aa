//! A drawn flight.

use super::class::Venue;
use afbc_scenario::Scenario;

/// A drawn flight.
#[derive(Clone, Debug, PartialEq)]
pub struct RoughFlight {
    /// Seed that the flight was drawn from.
    pub seed: u64,
    /// Name of the vehicle.
    pub vehicle: String,
    /// Name of the flight's class.
    pub class: &'static str,
    /// Names of the drawn classes: the flight's class, or the two classes of a mixture.
    pub parts: Vec<&'static str>,
    /// Number among the flights of the same seed, vehicle and class, from 1.
    pub number: u64,
    /// Place of the flight, indoors or outdoors.
    pub place: Venue,
    /// Scenario to fly.
    pub scenario: Scenario,
}

//! A drawn flight.

use super::class::Venue;
use afbc_scenario::Scenario;

/// A drawn flight.
#[derive(Clone, Debug, PartialEq)]
pub struct RoughFlight {
    /// Seed that it was drawn from.
    pub seed: u64,
    /// Name of the vehicle.
    pub vehicle: String,
    /// Name of its class.
    pub class: &'static str,
    /// The classes that were drawn: its own, or the two of a mixture.
    pub parts: Vec<&'static str>,
    /// Number among the flights of the same seed, vehicle and class, from 1.
    pub number: u64,
    /// Where it is.
    pub place: Venue,
    /// The flight.
    pub scenario: Scenario,
}

//! A flight together with its scenario.

use crate::run::FlightResult;
use afbc_scenario::Scenario;

/// One contender's flight of one scenario.
#[derive(Clone, Debug)]
pub struct ScenarioFlight {
    /// The scenario that was flown.
    pub scenario: Scenario,
    /// The flight.
    pub run: FlightResult,
}

//! A flight together with its scenario.

use crate::run::Run;
use afbc_scenario::Scenario;

/// One contender's flight of one scenario.
#[derive(Clone, Debug)]
pub struct Flown {
    /// The scenario that was flown.
    pub scenario: Scenario,
    /// The flight.
    pub run: Run,
}

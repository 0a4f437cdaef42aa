//! A flight with its scenario.

use crate::run::Run;
use afbc_scenario::Scenario;

/// One contender's flight of one scenario.
#[derive(Clone, Debug)]
pub struct Flown {
    /// The scenario flown.
    pub scenario: Scenario,
    /// The flight.
    pub run: Run,
}

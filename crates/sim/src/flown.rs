//! A flight and what was flown.

use crate::run::Run;
use crate::scenario::Scenario;

/// One contender's flight of one scenario.
#[derive(Clone, Debug)]
pub struct Flown {
    /// What was flown.
    pub scenario: Scenario,
    /// How it went.
    pub run: Run,
}

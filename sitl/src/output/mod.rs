//! What a flight leaves behind: table, CSV, summary, figures, report.

use crate::run::Run;
use crate::scenario::Scenario;

/// One flown law of one scenario.
#[derive(Clone, Debug)]
pub struct Flown {
    /// What was flown.
    pub scenario: Scenario,
    /// How it went.
    pub run: Run,
}

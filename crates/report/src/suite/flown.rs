//! A flown suite.

use afbc_campaign::compare::Comparison;
use afbc_campaign::suite::{Suite, SuiteFlight};

/// A flown suite.
#[derive(Clone, Copy, Debug)]
pub struct FlownSuite<'a> {
    /// The suite.
    pub suite: &'a Suite,
    /// Results of the flights under every contender, in the suite's order.
    pub comparisons: &'a [Comparison],
}

impl<'a> FlownSuite<'a> {
    /// Returns each flight with its results.
    pub(crate) fn rows(self) -> impl Iterator<Item = (&'a SuiteFlight, &'a Comparison)> {
        self.suite.flights.iter().zip(self.comparisons)
    }
}

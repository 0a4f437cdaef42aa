//! Differences between the contenders of a comparison, seed by seed.

use crate::compare::{Comparison, ContenderFlights};
use crate::statistics::{Median, SignedRank, holm};
use afbc_sim::metrics::Metrics;

/// Difference of a figure between two contenders over the same seeds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairedDifference {
    /// Number of seeds.
    pub seeds: usize,
    /// Median of the differences, this contender's value minus the other's. A lost vehicle's value is infinite.
    pub difference: Median,
    /// Signed rank test of the differences.
    pub test: SignedRank,
    /// The test's probability, adjusted by Holm's method for the number of contenders tested.
    pub p_holm: f64,
}

impl Comparison {
    /// Compares a figure of each contender with that of the contender at [`Comparison::baseline`]. Returns none for
    /// that contender itself, and for all with a single seed.
    pub fn paired_differences(&self, value: fn(&Metrics) -> f64) -> Vec<Option<PairedDifference>> {
        let Some(baseline) = self.entries.get(self.baseline) else { return Vec::new() };
        let others = baseline.values(value);
        let tested = |(place, entry): (usize, &ContenderFlights)| {
            let differences: Vec<f64> =
                entry.values(value).iter().zip(&others).map(|(own, other)| difference(*own, *other)).collect();
            let difference = Median::of(&differences).filter(|_| place != self.baseline && differences.len() > 1)?;
            Some((differences.len(), difference, SignedRank::of(&differences)))
        };
        let tested: Vec<_> = self.entries.iter().enumerate().map(tested).collect();
        let mut adjusted = holm(&tested.iter().flatten().map(|(_, _, test)| test.p).collect::<Vec<_>>()).into_iter();
        let mut difference_of =
            |(seeds, difference, test)| Some(PairedDifference { seeds, difference, test, p_holm: adjusted.next()? });
        tested.into_iter().map(|tested| tested.and_then(&mut difference_of)).collect()
    }
}

/// Returns the difference `own` minus `other` of two results. Returns 0 if both vehicles are lost.
fn difference(own: f64, other: f64) -> f64 {
    // The difference of two infinities would be NaN.
    if own == other { 0.0 } else { own - other }
}

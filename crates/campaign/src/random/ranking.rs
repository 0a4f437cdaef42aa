//! Ranking of the contenders: best distances, losses that others avoided, and paired differences with intervals.

use crate::statistics::{SignedRank, clustered, holm, percentile};
use libm::{exp, log};
use std::collections::BTreeMap;

/// A distance counts as level with the least one up to this factor.
const LEVEL_FACTOR: f64 = 1.05;
/// A distance counts as level with the least one up to this difference \[m\].
const LEVEL_M: f64 = 2e-4;
/// Smallest distance, so that the logarithm exists \[m\].
const DISTANCE_MIN_M: f64 = 1e-9;
/// Number of resamples for an interval.
pub const RESAMPLES: usize = 4000;

/// Distances by which the contenders of a flight are ranked.
#[derive(Clone, Debug, PartialEq)]
pub struct Score {
    /// Seed that the flight was drawn from.
    pub seed: u64,
    /// Root mean square distance of each contender from the reference \[m\]; none if it lost the vehicle.
    pub rms_m: Vec<Option<f64>>,
}

/// Result of one contender over all flights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ranking {
    /// Number of flights in which the contender is best, or level with the best.
    pub wins: usize,
    /// Number of vehicles lost.
    pub lost: usize,
    /// Number of vehicles lost in flights that some other contender survived.
    pub lost_alone: usize,
    /// Median distance over all flights \[m\]; none if the median flight is a lost one.
    pub median_m: Option<f64>,
    /// Geometric mean of the distances in the flights without a loss \[m\]; none if there are none.
    pub geometric_m: Option<f64>,
    /// Difference from the contender that all are compared with; none if no flight was survived by both.
    pub difference: Option<RankingDifference>,
}

/// Mean difference of the logarithms of two contenders' distances, over the flights that both survived.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RankingDifference {
    /// Number of flights that both survived.
    pub flights: usize,
    /// Mean difference of the logarithms.
    pub mean: f64,
    /// Ends of the mean's 95 % confidence interval; none for a single cluster.
    pub interval: Option<[f64; 2]>,
    /// Signed rank test of the clusters' mean differences.
    pub test: SignedRank,
    /// The test's probability, adjusted by Holm's method for the number of contenders tested.
    pub p_holm: f64,
}

/// True if the distance `own_m` is the best or level with the best, `best_m`.
pub fn is_level(own_m: f64, best_m: f64) -> bool {
    own_m <= (LEVEL_FACTOR * best_m).max(best_m + LEVEL_M)
}

impl Score {
    /// Returns the least distance \[m\]; none if every contender lost the vehicle.
    pub fn best_m(&self) -> Option<f64> {
        self.rms_m.iter().flatten().copied().reduce(f64::min)
    }

    /// Returns the distance of a contender \[m\]; none if it lost the vehicle.
    pub fn of(&self, contender: usize) -> Option<f64> {
        self.rms_m.get(contender).copied().flatten()
    }
}

/// Returns the ranking of each contender of `results`, compared with the contender at index `baseline`.
pub fn rankings(results: &[Score], baseline: usize) -> Vec<Ranking> {
    let contenders = results.first().map_or(0, |result| result.rms_m.len());
    let mut rankings: Vec<Ranking> = (0..contenders).map(|contender| ranking(results, contender, baseline)).collect();
    let differences = || rankings.iter().enumerate().filter(|(place, _)| *place != baseline);
    let p: Vec<f64> = differences().filter_map(|(_, ranking)| Some(ranking.difference?.test.p)).collect();
    let tested = rankings.iter_mut().enumerate().filter(|(place, _)| *place != baseline);
    let tested = tested.filter_map(|(_, ranking)| ranking.difference.as_mut());
    tested.zip(holm(&p)).for_each(|(difference, adjusted)| difference.p_holm = adjusted);
    rankings
}

fn ranking(results: &[Score], contender: usize, baseline: usize) -> Ranking {
    let level =
        |result: &&Score| result.of(contender).zip(result.best_m()).is_some_and(|(own, best)| is_level(own, best));
    let lost = || results.iter().filter(|result| result.of(contender).is_none());
    let kept: Vec<f64> = results.iter().filter_map(|result| result.of(contender)).collect();
    let mut all = kept.clone();
    all.resize(results.len(), f64::INFINITY);
    all.sort_by(f64::total_cmp);
    let logs = kept.iter().map(|distance_m| logarithm(*distance_m)).sum::<f64>();
    Ranking {
        wins: results.iter().filter(level).count(),
        lost: lost().count(),
        lost_alone: lost().filter(|result| result.best_m().is_some()).count(),
        median_m: percentile(&all, 50.0).filter(|median_m| median_m.is_finite()),
        geometric_m: (!kept.is_empty()).then(|| exp(logs / kept.len() as f64)),
        difference: difference(results, contender, baseline),
    }
}

fn difference(results: &[Score], contender: usize, baseline: usize) -> Option<RankingDifference> {
    // The differences of the two contenders are collected for each seed.
    let mut seeds: BTreeMap<u64, Vec<f64>> = BTreeMap::new();
    for result in results {
        if let (Some(own_m), Some(other_m)) = (result.of(contender), result.of(baseline)) {
            seeds.entry(result.seed).or_default().push(logarithm(own_m) - logarithm(other_m));
        }
    }
    // A single seed does not show how seeds differ, so each of its flights becomes a cluster.
    let clusters: Vec<Vec<f64>> = match seeds.len() {
        1 => seeds.into_values().flatten().map(|difference| vec![difference]).collect(),
        _ => seeds.into_values().collect(),
    };
    let flights = clusters.iter().map(Vec::len).sum();
    let mean = clusters.iter().flatten().sum::<f64>() / flights as f64;
    let means: Vec<f64> = clusters.iter().map(|cluster| cluster.iter().sum::<f64>() / cluster.len() as f64).collect();
    let test = SignedRank::of(&means);
    let interval = clustered(&clusters, RESAMPLES);
    (flights > 0).then_some(RankingDifference { flights, mean, interval, test, p_holm: test.p })
}

fn logarithm(distance_m: f64) -> f64 {
    log(distance_m.max(DISTANCE_MIN_M))
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]
    use super::*;

    fn result(seed: u64, rms_m: [Option<f64>; 3]) -> Score {
        Score { seed, rms_m: rms_m.to_vec() }
    }

    fn close(a: f64, b: f64) {
        assert!((a - b).abs() < 1e-12, "{a} != {b}");
    }

    /// Checks figures counted by hand. A flight that all lose counts as nobody's, and distances within 5 % or 0.2 mm
    /// are level.
    #[test]
    fn the_figures_are_those_counted_by_hand() {
        let results = [
            result(1, [Some(0.01), Some(0.04), Some(0.0102)]),
            result(1, [None, Some(0.09), None]),
            result(2, [Some(0.0003), Some(0.0001), Some(0.00031)]),
            result(2, [None, None, None]),
            result(3, [Some(0.04), None, Some(0.05)]),
        ];
        let [a, b, c] = rankings(&results, 0).try_into().unwrap();
        assert_eq!((a.wins, a.lost, a.lost_alone), (3, 2, 1));
        assert_eq!((b.wins, b.lost, b.lost_alone), (2, 2, 1));
        assert_eq!((c.wins, c.lost, c.lost_alone), (1, 2, 1));
        // The median is the third of five. `b` survived three flights.
        assert_eq!((a.median_m, b.median_m, c.median_m), (Some(0.04), Some(0.09), Some(0.05)));
        close(a.geometric_m.unwrap(), (0.01_f64 * 0.0003 * 0.04).cbrt());
        close(b.geometric_m.unwrap(), (0.04_f64 * 0.09 * 0.0001).cbrt());
        let test = SignedRank { p: 1.0, effect: 0.0 };
        let own = RankingDifference { flights: 3, mean: 0.0, interval: Some([0.0; 2]), test, p_holm: 1.0 };
        assert_eq!(a.difference, Some(own));
        // Both `a` and `b` survived the first and third flights.
        let b = b.difference.unwrap();
        assert_eq!(b.flights, 2);
        close(b.mean, 0.5 * (4.0_f64.ln() - 3.0_f64.ln()));
        let [low, high] = b.interval.unwrap();
        close(low, -(3.0_f64.ln()));
        close(high, 4.0_f64.ln());
        // `c` is further away in all three seeds: p = 2/2^3. `b` is further away in one seed of two: p = 1.
        let c = c.difference.unwrap();
        assert_eq!((c.flights, c.test, c.p_holm), (3, SignedRank { p: 0.25, effect: 1.0 }, 0.5));
        assert_eq!((b.test.p, b.p_holm), (1.0, 1.0));
    }

    #[test]
    fn a_median_that_is_lost_is_none_and_so_is_the_mean_of_nothing() {
        let lost = result(1, [None, Some(0.1), None]);
        let rankings = rankings(&[lost.clone(), lost, result(1, [Some(0.2), Some(0.1), None])], 1);
        assert_eq!((rankings[0].median_m, rankings[0].geometric_m), (None, Some(exp(log(0.2)))));
        assert_eq!((rankings[2].median_m, rankings[2].geometric_m, rankings[2].difference), (None, None, None));
    }

    /// Flights of one seed form one cluster. With equal copies, the interval equals that of one flight per seed.
    /// Flights of a single seed are separate clusters.
    #[test]
    fn flights_are_clustered_by_seed() {
        let at = |seed, factor: f64| result(seed, [Some(0.1), Some(0.1 * factor), Some(0.1)]);
        let factors = [1.5, 0.8, 1.2, 1.1, 0.9];
        let interval = |copies: usize| {
            let seeds = factors.iter().zip(1..).flat_map(|(factor, seed)| vec![at(seed, *factor); copies]);
            rankings(&seeds.collect::<Vec<_>>(), 0)[1].difference.unwrap().interval.unwrap()
        };
        let ([low, high], [one_low, one_high]) = (interval(7), interval(1));
        close(low, one_low);
        close(high, one_high);
        let single: Vec<_> = factors.iter().map(|factor| at(9, *factor)).collect();
        assert_eq!(rankings(&single, 0)[1].difference.unwrap().interval, Some([one_low, one_high]));
        assert_eq!(rankings(&single[..1], 0)[1].difference.unwrap().interval, None);
    }
}

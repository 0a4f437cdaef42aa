//! Medians with confidence intervals that assume nothing about the distribution.

use super::CONFIDENCE;
use libm::{exp, log};

/// A median of the flights, with a confidence interval for the median of all seeds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Median {
    /// The middle value, or the mean of the middle two. Infinite if a middle value is a lost flight's; NaN if the
    /// middle two are infinities of opposite signs.
    pub value: f64,
    /// Two of the values, which enclose the median of all seeds in at least 95 % of all experiments; none for fewer
    /// than six values.
    pub interval: Option<[f64; 2]>,
}

impl Median {
    /// Returns the median of `values`, which may be infinite; none without values.
    ///
    /// The interval ends have the same rank from the lower and from the upper end. The rank is the largest whose
    /// coverage, by the binomial distribution, is at least 95 % (David, Nagaraja 2003, *Order statistics*, section
    /// 7.1).
    pub fn of(values: &[f64]) -> Option<Self> {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let count = sorted.len();
        let [low, high] = [sorted.get(count.checked_sub(1)? / 2)?, sorted.get(count / 2)?];
        // Equal values, also infinities, are their own mean.
        let value = if low == high { *low } else { 0.5 * (low + high) };
        let ends = rank(count).and_then(|rank| Some([*sorted.get(rank - 1)?, *sorted.get(count - rank)?]));
        Some(Median { value, interval: ends })
    }
}

/// Returns the largest rank, from 1 on, at which the two values of that rank from both ends enclose the median with the
/// wanted confidence; none if not even the extremes do.
fn rank(count: usize) -> Option<usize> {
    // `logarithm` is that of the probability that exactly `below` values are below the median. 2^-count itself would
    // underflow.
    let mut logarithm = -(count as f64) * core::f64::consts::LN_2;
    let (mut outside, mut rank) = (0.0, 0);
    for below in 0..count / 2 {
        outside += 2.0 * exp(logarithm);
        if outside > 1.0 - CONFIDENCE {
            break;
        }
        rank = below + 1;
        logarithm += log((count - below) as f64 / (below + 1) as f64);
    }
    (rank > 0).then_some(rank)
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]
    use super::*;
    use afbc_plant::noise::{Noise, NoiseStream};

    /// Values by scipy 1.17.1: `scipy.stats.binom.ppf(0.025, n, 0.5)` for each number.
    #[test]
    fn ranks_are_those_of_the_binomial_distribution() {
        for (count, expected) in [
            (0, None),
            (5, None),
            (6, Some(1)),
            (8, Some(1)),
            (9, Some(2)),
            (10, Some(2)),
            (20, Some(6)),
            (30, Some(10)),
            (100, Some(40)),
            (1000, Some(469)),
            (10_000, Some(4902)),
        ] {
            assert_eq!(rank(count), expected, "{count}");
        }
    }

    /// Counts all 2^n ways in which values may fall on both sides of the median. The interval encloses the median in at
    /// least 95 % of them, the next inner interval in fewer.
    #[test]
    fn coverage_is_that_of_all_sides_counted() {
        for count in 6..=16 {
            let share = |rank: u32| {
                let encloses = |sides: &u32| (rank..=count - rank).contains(&sides.count_ones());
                f64::from((0..1_u32 << count).filter(encloses).count() as u32) / f64::from(1_u32 << count)
            };
            let rank = rank(count as usize).unwrap() as u32;
            assert!(share(rank) >= CONFIDENCE, "{count}");
            assert!(rank + 1 > count / 2 || share(rank + 1) < CONFIDENCE, "{count}");
        }
    }

    #[test]
    fn it_lies_in_the_middle_of_its_interval_whatever_the_order() {
        let mut noise = Noise::new(3, NoiseStream::Scenario);
        for count in 1..60 {
            let values: Vec<f64> = (0..count).map(|_| noise.normal()).collect();
            let median = Median::of(&values).unwrap();
            let below = values.iter().filter(|value| **value < median.value).count();
            let above = values.iter().filter(|value| **value > median.value).count();
            assert_eq!(below, above, "{count}");
            let mut reversed = values;
            reversed.reverse();
            assert_eq!(Median::of(&reversed), Some(median));
            assert_eq!(median.interval.is_some(), count >= 6);
            assert!(median.interval.is_none_or(|[low, high]| low <= median.value && median.value <= high));
        }
        assert_eq!(Median::of(&[]), None);
    }

    /// Lost flights count as infinite. The median is infinite as soon as half of the flights are lost.
    #[test]
    fn lost_flights_are_the_worst() {
        let lost = f64::INFINITY;
        assert_eq!(Median::of(&[0.3, lost, 0.1]).unwrap().value, 0.3);
        assert_eq!(Median::of(&[0.3, lost]).unwrap().value, lost);
        assert_eq!(Median::of(&[lost, lost]).unwrap().value, lost);
        assert!(Median::of(&[-lost, lost]).unwrap().value.is_nan());
        assert_eq!(Median::of(&[1.0, 2.0, 3.0, 4.0, 5.0, lost]).unwrap().interval, Some([1.0, lost]));
    }
}

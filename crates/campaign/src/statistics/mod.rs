//! Statistics of many flights.

mod median;
mod signed_rank;

pub use median::Median;
pub use signed_rank::{SignedRank, holm};

use afbc_plant::noise::{Noise, NoiseStream};
use libm::sqrt;

/// 97.5 % quantile of the standard normal distribution, for two-sided 95 %.
const Z: f64 = 1.959_963_984_540_054;
/// Least confidence of every interval.
const CONFIDENCE: f64 = 0.95;

/// A share with Wilson's 95 % score interval, which is also valid near 0 and 1, where few flights are lost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Share {
    /// Observed share.
    pub value: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end of the interval.
    pub high: f64,
}

impl Share {
    /// Returns the share of `hits` in `trials`; NaN without trials.
    pub fn of(hits: u64, trials: u64) -> Self {
        if trials == 0 {
            return Share { value: f64::NAN, low: 0.0, high: 1.0 };
        }
        let (n, p) = (trials as f64, hits as f64 / trials as f64);
        let scale = 1.0 + Z * Z / n;
        let centre = (p + Z * Z / (2.0 * n)) / scale;
        let half = Z / scale * sqrt(p * (1.0 - p) / n + Z * Z / (4.0 * n * n));
        // For the shares 0 and 1, the formula gives the limits 0 and 1 except for rounding.
        let low = if hits == 0 { 0.0 } else { (centre - half).max(0.0) };
        let high = if hits == trials { 1.0 } else { (centre + half).min(1.0) };
        Share { value: p, low, high }
    }
}

/// Returns the percentile of `sorted` values by nearest rank: the smallest value that at least `percent` of the values
/// do not exceed. The result is always one of the values; none without values.
pub fn percentile(sorted: &[f64], percent: f64) -> Option<f64> {
    // Ranks begin at 1, even for 0 %.
    let rank = (percent / 100.0 * sorted.len() as f64).ceil().max(1.0) as usize;
    sorted.get(rank - 1).copied()
}

/// Returns the 95 % confidence interval of the mean of all values in `clusters`, by the percentile bootstrap with this
/// many resamples. Each cluster is drawn as a whole (Davison, Hinkley 1997, *Bootstrap methods and their application*,
/// sections 3.8 and 5.3). The same values give the same interval. Returns none for fewer than two clusters.
pub fn clustered(clusters: &[Vec<f64>], resamples: usize) -> Option<[f64; 2]> {
    if clusters.len() < 2 {
        return None;
    }
    let sums: Vec<(f64, usize)> = clusters.iter().map(|values| (values.iter().sum(), values.len())).collect();
    let mut noise = Noise::new(0, NoiseStream::Scenario);
    let mut mean = |_| {
        let drawn = sums.iter().filter_map(|_| sums.get((noise.uniform() * sums.len() as f64) as usize));
        let (sum, count) = drawn.fold((0.0, 0), |(sum, count), (more, others)| (sum + more, count + others));
        sum / count as f64
    };
    let mut means: Vec<f64> = (0..resamples).map(&mut mean).collect();
    means.sort_by(f64::total_cmp);
    Some([percentile(&means, 2.5)?, percentile(&means, 97.5)?])
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]
    use super::*;

    fn close(a: f64, b: f64) {
        assert!((a - b).abs() < 5e-5, "{a} != {b}");
    }

    /// Compares with Newcombe 1998, Statistics in Medicine 17, table I, method 3.
    #[test]
    fn wilson_interval_is_the_published_one() {
        for (hits, trials, low, high) in
            [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611), (1, 29, 0.0061, 0.1718)]
        {
            let share = Share::of(hits, trials);
            close(share.low, low);
            close(share.high, high);
            // The interval of the misses is the mirror image.
            let misses = Share::of(trials - hits, trials);
            close(misses.low, 1.0 - high);
            close(misses.high, 1.0 - low);
        }
    }

    #[test]
    fn a_share_of_no_flights_is_unknown() {
        let share = Share::of(0, 0);
        assert!(share.value.is_nan());
        assert_eq!((share.low, share.high), (0.0, 1.0));
    }

    #[test]
    fn percentiles_are_nearest_ranks() {
        let sorted = [15.0, 20.0, 35.0, 40.0, 50.0];
        for (percent, value) in [(0.0, 15.0), (5.0, 15.0), (30.0, 20.0), (40.0, 20.0), (50.0, 35.0), (100.0, 50.0)] {
            assert_eq!(percentile(&sorted, percent).unwrap(), value, "{percent}");
        }
        let hundred: Vec<f64> = (1..=100).map(f64::from).collect();
        assert_eq!(percentile(&hundred, 90.0).unwrap(), 90.0);
        assert_eq!(percentile(&hundred, 99.0).unwrap(), 99.0);
        assert_eq!(percentile(&[], 50.0), None);
        // A lost flight ranks last.
        assert_eq!(percentile(&[0.1, 0.2, f64::INFINITY], 99.0).unwrap(), f64::INFINITY);
    }

    /// With the values 0 and 1, a quarter of the resamples have mean 0 and a quarter mean 1. With many values, the
    /// interval is that of the normal distribution. Clusters count by their size.
    #[test]
    fn the_bootstrap_interval_is_the_known_one() {
        assert_eq!(clustered(&[vec![0.0], vec![1.0]], 1000), Some([0.0, 1.0]));
        assert_eq!(clustered(&[vec![3.0, 4.0]], 1000), None);
        let mut noise = Noise::new(1, NoiseStream::Scenario);
        let values: Vec<f64> = (0..400).map(|_| noise.normal()).collect();
        let mean = values.iter().sum::<f64>() / 400.0;
        let variance = values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / 400.0;
        let half = Z * sqrt(variance / 400.0);
        let single: Vec<Vec<f64>> = values.iter().map(|value| vec![*value]).collect();
        let [low, high] = clustered(&single, 4000).unwrap();
        assert!((low - (mean - half)).abs() < 0.1 * half && (high - (mean + half)).abs() < 0.1 * half);
        assert_eq!(clustered(&single, 4000), Some([low, high]));
        // Ten equal copies of 40 values carry no more information than the 40 values, so the interval is wider by a
        // factor of sqrt(10).
        let copies: Vec<Vec<f64>> = values.iter().take(40).map(|value| vec![*value; 10]).collect();
        let [low, high] = clustered(&copies, 4000).unwrap();
        assert!((high - low) / (2.0 * half) > 2.2, "{low} to {high}");
        // Two clusters of 9 and 1 values, whose overall mean is 0.9.
        let [low, high] = clustered(&[vec![1.0; 9], vec![0.0]], 20).unwrap();
        assert_eq!((low, high), (0.0, 1.0));
    }
}

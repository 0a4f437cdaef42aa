//! Statistics of many flights.

use libm::sqrt;

/// 97.5 % quantile of the standard normal distribution: two-sided 95 %.
const Z: f64 = 1.959_963_984_540_054;

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
        // At the ends the formula gives the end itself, except for rounding.
        let low = if hits == 0 { 0.0 } else { (centre - half).max(0.0) };
        let high = if hits == trials { 1.0 } else { (centre + half).min(1.0) };
        Share { value: p, low, high }
    }
}

/// Returns the percentile of `sorted` values by nearest rank: the smallest value that at least `percent` of them do not
/// exceed. It is always one of the values. None without values.
pub fn percentile(sorted: &[f64], percent: f64) -> Option<f64> {
    let rank = (percent / 100.0 * sorted.len() as f64).ceil().max(1.0) as usize;
    sorted.get(rank - 1).copied()
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]
    use super::*;

    fn close(a: f64, b: f64) {
        assert!((a - b).abs() < 5e-5, "{a} != {b}");
    }

    /// Compared with Newcombe 1998, Statistics in Medicine 17, table I, method 3.
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
}

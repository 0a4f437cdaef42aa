//! Medians with a band around them, over flights of several seeds or over the rows of a campaign.

use crate::table::Points;

/// A median curve with a band around it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Band {
    /// Points of the median.
    pub median: Points,
    /// Lower and upper edge of the band, each pair with its x.
    pub edges: Vec<(f64, [f64; 2])>,
}

/// Number of time steps at which [`over_seeds`] computes the median.
const GRID: usize = 400;
/// Each bin of [`binned`] has at least this many rows; there are at most `BINS` bins.
const ROWS: usize = 25;
const BINS: usize = 40;

/// Returns the median of several flights over time, and the band that holds the middle `percent` of them. The curves
/// cover the times at which at least half of the flights are under way. Flights are interpolated linearly between
/// samples.
pub fn over_seeds(flights: &[Points], percent: f64) -> Band {
    let ends = |end: fn(&Points) -> Option<&(f64, f64)>| flights.iter().filter_map(end).map(|(x, _)| *x);
    let (start, end) =
        (ends(|f| f.first()).fold(f64::INFINITY, f64::min), ends(|f| f.last()).fold(f64::NEG_INFINITY, f64::max));
    let mut band = Band::default();
    for step in 0..=GRID {
        let x = start + (end - start) * step as f64 / GRID as f64;
        let values: Vec<f64> = flights.iter().filter_map(|flight| value_at(flight, x)).collect();
        if 2 * values.len() >= flights.len() {
            band.add(x, values, percent);
        }
    }
    band
}

/// Returns the median of rows over x, and the band that holds the middle `percent` of them.
///
/// If x takes few distinct values, there is one bin per value. Otherwise neighbouring rows form bins of equal size.
pub fn binned(mut rows: Points, percent: f64) -> Band {
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    let levels: Vec<&[(f64, f64)]> = rows.chunk_by(|a, b| a.0 == b.0).collect();
    let bins: Vec<&[(f64, f64)]> = if levels.len() <= BINS {
        levels
    } else {
        let bins = (rows.len() / ROWS).clamp(1, BINS);
        rows.chunks(rows.len().div_ceil(bins)).collect()
    };
    let mut band = Band::default();
    for bin in bins {
        let x = bin.iter().map(|(x, _)| x).sum::<f64>() / bin.len() as f64;
        band.add(x, bin.iter().map(|(_, y)| *y).collect(), percent);
    }
    band
}

impl Band {
    fn add(&mut self, x: f64, mut values: Vec<f64>, percent: f64) {
        values.sort_by(f64::total_cmp);
        let outside = 0.5 * (1.0 - percent / 100.0);
        let at = |share: f64| quantile(&values, share);
        if let (Some(low), Some(median), Some(high)) = (at(outside), at(0.5), at(1.0 - outside)) {
            self.median.push((x, median));
            self.edges.push((x, [low, high]));
        }
    }
}

/// Returns a quantile of sorted values by linear interpolation, as `numpy.quantile` does.
fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    let place = share.clamp(0.0, 1.0) * sorted.len().checked_sub(1)? as f64;
    let (below, part) = (place as usize, place.fract());
    let low = *sorted.get(below)?;
    Some(sorted.get(below + 1).map_or(low, |high| low + part * (high - low)))
}

/// Returns a flight's value at `x` by linear interpolation; `None` before its start and after its end.
fn value_at(flight: &Points, x: f64) -> Option<f64> {
    let after = flight.partition_point(|(at, _)| *at < x);
    let (x1, y1) = *flight.get(after)?;
    if x1 == x {
        return Some(y1);
    }
    let (x0, y0) = *flight.get(after.checked_sub(1)?)?;
    Some(y0 + (y1 - y0) * (x - x0) / (x1 - x0))
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]
    use super::*;

    /// Eleven flights have the constant values 0 to 10 and different sample times. The median is 5, and the band of 80
    /// % goes from 1 to 9.
    #[test]
    fn the_band_of_seeds_holds_its_share() {
        let flight = |height: usize| -> Points {
            let samples = 3 + height;
            (0..=samples).map(|i| (10.0 * i as f64 / samples as f64, height as f64)).collect()
        };
        let flights: Vec<Points> = (0..=10).rev().map(flight).collect();
        let band = over_seeds(&flights, 80.0);
        assert_eq!((band.median.len(), band.edges.len()), (GRID + 1, GRID + 1));
        assert!(band.median.iter().all(|(_, y)| (y - 5.0).abs() < 1e-9));
        assert!(band.edges.iter().all(|(_, [low, high])| (low - 1.0).abs() < 1e-9 && (high - 9.0).abs() < 1e-9));
        assert_eq!((band.median.first().unwrap().0, band.median.last().unwrap().0), (0.0, 10.0));
    }

    /// A flight that ends early counts up to its end. The median ends when fewer than half of the flights remain.
    #[test]
    fn flights_count_while_they_last() {
        let until = |end: f64, y: f64| vec![(0.0, y), (end, y)];
        let band = over_seeds(&[until(10.0, 1.0), until(10.0, 2.0), until(4.0, 9.0)], 100.0);
        let at = |x: f64| band.median.iter().find(|(at, _)| (at - x).abs() < 1e-9).unwrap().1;
        assert_eq!((at(2.0), at(8.0)), (2.0, 1.5));
        let band = over_seeds(&[until(10.0, 1.0), until(4.0, 2.0), until(4.0, 9.0)], 100.0);
        assert!((band.median.last().unwrap().0 - 4.0).abs() < 0.03);
        assert_eq!(over_seeds(&[], 80.0), Band::default());
    }

    /// Expected values are from `numpy.quantile([1, 2, 4, 8], [0, 0.1, 0.5, 0.9, 1])`.
    #[test]
    fn quantiles_are_numpys() {
        for (share, expected) in [(0.0, 1.0), (0.1, 1.3), (0.5, 3.0), (0.9, 6.8), (1.0, 8.0)] {
            assert!((quantile(&[1.0, 2.0, 4.0, 8.0], share).unwrap() - expected).abs() < 1e-12);
        }
        assert_eq!(quantile(&[], 0.5), None);
    }

    #[test]
    fn rows_are_binned_by_number_or_by_level() {
        let rows: Points = (0..1000).map(|i| (f64::from(i * 7 % 1000), f64::from(i * 7 % 1000) * 2.0)).collect();
        let band = binned(rows, 50.0);
        assert_eq!(band.median.len(), BINS);
        assert!(band.median.windows(2).all(|two| matches!(two, [a, b] if a.0 < b.0)));
        assert!(band.median.iter().all(|(x, y)| (y - 2.0 * x).abs() < 1e-9), "{:?}", band.median);
        let levels: Points = (0..90).map(|i| (f64::from(i % 3), f64::from(i / 3))).collect();
        let band = binned(levels, 50.0);
        assert_eq!(band.median, [(0.0, 14.5), (1.0, 14.5), (2.0, 14.5)]);
    }
}

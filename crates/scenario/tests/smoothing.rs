//! Paths from rounded samples are as smooth as the motion that was sampled.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

use afbc_scenario::trajectory::polynomial::{PolynomialPiece, peaks};
use afbc_scenario::trajectory::smoothing::{RoundedColumn, smoothed};
use core::f64::consts::TAU;
use proptest::prelude::*;

/// A figure of eight: value and four derivatives of x, y, z and yaw at time t.
fn eight(size_m: f64, period_s: f64, t: f64) -> [[f64; 5]; 4] {
    let w = TAU / period_s;
    let sine = |a: f64, k: f64, phase: f64| {
        [0, 1, 2, 3, 4].map(|n| a * (k * w).powi(n) * (k * w * t + phase + f64::from(n) * TAU / 4.0).sin())
    };
    let mut z = sine(0.1 * size_m, 1.0, 0.3);
    z[0] += 3.0;
    [sine(size_m, 1.0, 0.0), sine(0.5 * size_m, 2.0, 0.0), z, sine(0.8, 1.0, 1.0)]
}

/// Returns the columns of samples, rounded to multiples of `unit`: values, and first derivatives if `rates`.
fn rounded(times: &[f64], unit: f64, rates: bool, of: impl Fn(f64) -> [[f64; 5]; 4]) -> [Vec<Vec<f64>>; 4] {
    let orders = if rates { 2 } else { 1 };
    let column =
        |axis: usize, order: usize| times.iter().map(|t| (of(*t)[axis][order] / unit).round() * unit).collect();
    [0, 1, 2, 3].map(|axis| (0..orders).map(|order| column(axis, order)).collect())
}

fn path(times: &[f64], unit: f64, columns: &[Vec<Vec<f64>>; 4]) -> Option<Vec<PolynomialPiece>> {
    let axes = columns.each_ref().map(|columns| {
        let column = |(order, values): (usize, &Vec<f64>)| RoundedColumn { order, values: values.clone().leak(), unit };
        columns.iter().enumerate().map(column).collect::<Vec<_>>()
    });
    smoothed(times, axes.each_ref().map(Vec::as_slice))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    /// For any rate, rounding and size, the path passes within a unit of every sample, and has no more snap than the
    /// motion, apart from what its own rounding hides.
    #[test]
    fn a_rounded_path_is_as_smooth_as_the_motion(
        size_m in 0.5..8.0_f64,
        period_s in 5.0..20.0_f64,
        rate_hz in prop_oneof![Just(10.0), Just(20.0), Just(30.0), Just(50.0), Just(100.0)],
        decimals in 3..7_i32,
        rates: bool,
        jitter in 0.0..0.3_f64,
        seed: u64,
    ) {
        let count = (1.5 * period_s * rate_hz) as usize;
        let mut state = seed | 1;
        let mut random = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let times: Vec<f64> = (0..count).map(|i| (i as f64 + jitter * random()) / rate_hz).collect();
        let unit = 0.1_f64.powi(decimals);
        let motion = |t| eight(size_m, period_s, t);
        let columns = rounded(&times, unit, rates, motion);
        let pieces = path(&times, unit, &columns).unwrap();
        let find = |t: f64| pieces.iter().rev().find(|piece| piece.start_s <= t + 1e-12).unwrap().at(t);
        for (i, t) in times.iter().enumerate() {
            let at = find(*t);
            for (axis, value) in [at.position_m.x, at.position_m.y, at.position_m.z, at.yaw_rad].iter().enumerate() {
                prop_assert!((value - columns[axis][0][i]).abs() <= unit, "{t} s, {axis}");
            }
        }
        let most = |order: usize| {
            let norm = |t: &f64| (0..3).map(|axis| motion(*t)[axis][order].powi(2)).sum::<f64>().sqrt();
            times.iter().map(norm).fold(0.0, f64::max)
        };
        // The ends of a path are known from one side only.
        let end_s = f64::max(0.5, 10.0 / rate_hz);
        let (first, last) = (times[0] + end_s, times[count - 1] - end_s);
        let inner: Vec<_> = pieces.iter().filter(|p| p.start_s > first && p.end_s() < last).copied().collect();
        let [_, acceleration, jerk, snap] = peaks(&inner, 8);
        prop_assert!(acceleration < 1.15 * most(2) + 0.3, "{acceleration} m/s2, {}", most(2));
        prop_assert!(jerk < 1.3 * most(3) + 3.0, "{jerk} m/s3, {}", most(3));
        prop_assert!(snap < 1.5 * most(4) + 40.0, "{snap} m/s4, {}", most(4));
    }
}

/// Pieces join with six derivatives.
#[test]
fn pieces_join_smoothly() {
    let times: Vec<f64> = (0..200).map(|i| f64::from(i) * 0.03).collect();
    let columns = rounded(&times, 1e-3, false, |t| eight(2.0, 4.0, t));
    for pair in path(&times, 1e-3, &columns).unwrap().windows(2) {
        let [end, begin] = [pair[0].at(pair[0].end_s()), pair[1].at(pair[1].start_s)];
        assert!((end.position_m - begin.position_m).norm() < 1e-9);
        assert!((end.snap_m_s4 - begin.snap_m_s4).norm() < 1e-4, "{end:?} {begin:?}");
    }
}

/// Samples whose errors are larger than their rounding are not smoothed: their detail may be meant.
#[test]
fn a_corner_is_not_a_rounding_error() {
    let times: Vec<f64> = (0..400).map(|i| f64::from(i) * 0.02).collect();
    let square = |t: f64| (t * 1.3).floor() % 2.0;
    let columns = rounded(&times, 1e-4, true, |t| [[square(t), 0.0, 0.0, 0.0, 0.0]; 4]);
    assert_eq!(path(&times, 1e-4, &columns), None);
    assert_eq!(path(&[0.0], 1e-4, &rounded(&[0.0], 1e-4, false, |t| eight(1.0, 5.0, t))), None);
}

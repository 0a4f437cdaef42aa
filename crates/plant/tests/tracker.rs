//! Compares the tracker with its declared properties, within five standard errors and with fixed seeds.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::float_cmp, missing_docs)] // tests

use crate::common;
use afbc_plant::instruments::{TrackerFix, TrackerModel};
use afbc_plant::{InstrumentSuite, MeasurementDropouts, Truth};
use common::{STEP_S, assert_sigma, coordinates, mean, rest, rotation, run};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

fn with(tracker: TrackerModel) -> InstrumentSuite {
    InstrumentSuite { tracker: Some(tracker), ..InstrumentSuite::default() }
}

/// Returns a motion whose position shows its step: x is the number of milliseconds.
fn moving(k: u32) -> Truth {
    let attitude = UnitQuaternion::from_euler_angles(0.2, -0.3, 0.5 + 1e-4 * f64::from(k % 1000)).into_inner();
    Truth { position_m: Vector3::new(f64::from(k), -2.0, 3.0), attitude, ..rest() }
}

/// Returns fixes with the step of their arrival.
fn fixes(tracker: TrackerModel, seed: u64, steps: u32) -> Vec<(u32, TrackerFix)> {
    let readings = run(with(tracker), seed, steps, moving);
    (0..).zip(readings).flat_map(|(k, readings)| readings.tracker.into_iter().map(move |fix| (k, fix))).collect()
}

/// Returns the step at which a fix was measured, by its stamp.
fn taken(fix: &TrackerFix) -> u32 {
    (fix.true_at_s / STEP_S).round() as u32
}

#[test]
fn a_perfect_one_sends_the_truth_at_once_at_its_rate() {
    for (rate_hz, steps) in [(100.0, 10.0), (240.0, 1000.0 / 240.0), (1000.0, 1.0), (7.0, 1000.0 / 7.0)] {
        let fixes = fixes(TrackerModel { rate_hz, ..TrackerModel::DEFAULT }, 1, 5000);
        let due = (0..).map(|n| (f64::from(n) * steps - 1e-6).ceil() as u32);
        let expected: Vec<u32> = due.take_while(|k| *k < 5000).collect();
        assert_eq!(fixes.iter().map(|(k, _)| *k).collect::<Vec<_>>(), expected, "{rate_hz} Hz");
        for (k, fix) in fixes {
            let truth = moving(k);
            assert_eq!(fix.true_at_s, f64::from(k) * STEP_S);
            assert_eq!((fix.position_m, fix.attitude), (truth.position_m, truth.attitude));
        }
    }
}

/// A fix arrives in the first step after its delay, which is uniform within the jitter. Its stamp is the time of its
/// motion.
#[test]
fn delays_are_spread_as_declared_and_stamps_show_them() {
    let tracker = TrackerModel { delay_s: 0.0105, jitter_s: 0.004, rate_hz: 250.0, ..TrackerModel::DEFAULT };
    let fixes = fixes(tracker, 2, 200_000);
    let mut late = Vec::new();
    for (k, fix) in &fixes {
        assert_eq!(fix.position_m.x, f64::from(taken(fix)), "the pose is that of the stamp");
        late.push(f64::from(k - taken(fix)) * STEP_S);
    }
    // The delay is uniform within 6.5 to 14.5 ms. Rounded up, it is 7 to 15 ms.
    assert!(late.iter().all(|late| (0.0069..0.0151).contains(late)));
    let n = late.len() as f64;
    // The delay spans eight steps: seven full ones and two halves at the ends. So rounding up adds half a step to the
    // mean.
    assert!((mean(&late) - 0.011).abs() < 5.0 * (0.004 / 3.0_f64.sqrt()) / n.sqrt() + 1e-5, "{}", mean(&late));
    let spread: Vec<f64> = late.iter().map(|late| late - 0.011).collect();
    let variance = 0.004_f64.powi(2) / 3.0 + STEP_S * STEP_S / 12.0;
    assert!((common::power(&spread) / variance - 1.0).abs() < 0.05);
    // Fixes with random delays do not always arrive in order.
    assert!(fixes.windows(2).any(|w| w[1].1.true_at_s < w[0].1.true_at_s));
    // No fix arrives before its motion.
    let early = self::fixes(TrackerModel { delay_s: 0.001, jitter_s: 0.1, ..tracker }, 2, 10_000);
    assert!(early.iter().any(|(k, fix)| *k == taken(fix)) && early.iter().all(|(k, fix)| *k >= taken(fix)));
    let preset = self::fixes(TrackerModel::MOCAP_100, 2, 100_000);
    assert!(preset.iter().all(|(k, fix)| (8..=12).contains(&(k - taken(fix)))));
    assert!(preset.windows(2).all(|w| w[1].1.true_at_s > w[0].1.true_at_s));
}

#[test]
fn stamps_have_their_errors() {
    let tracker = TrackerModel { stamp_s: 0.003, stamp_noise_s: 0.001, ..TrackerModel::DEFAULT };
    let errors: Vec<f64> =
        fixes(tracker, 3, 100_000).iter().map(|(k, fix)| fix.true_at_s - f64::from(*k) * STEP_S - 0.003).collect();
    assert_sigma(&errors, 0.001, "stamps");
    assert!(mean(&errors).abs() < 5.0 * 0.001 / (errors.len() as f64).sqrt());
}

/// Returns the errors of fixes that arrive at once: position, and rotation about the body axes.
fn errors(fixes: &[(u32, TrackerFix)]) -> (Vec<f64>, Vec<f64>) {
    let position = fixes.iter().map(|(k, fix)| fix.position_m - moving(*k).position_m);
    let attitude = fixes.iter().map(|(k, fix)| rotation(moving(*k).attitude.conjugate() * fix.attitude));
    (coordinates(position), coordinates(attitude))
}

#[test]
fn noise_has_its_spread_and_outliers_their_share() {
    let tracker = TrackerModel { position_m: 0.002, attitude_rad: 0.004, ..TrackerModel::DEFAULT };
    let clean = fixes(tracker, 4, 500_000);
    let (position, attitude) = errors(&clean);
    assert_sigma(&position, 0.002, "position");
    assert_sigma(&attitude, 0.004, "attitude");
    assert!(clean.iter().all(|(_, fix)| (fix.attitude.norm() - 1.0).abs() < 1e-12));

    let dirty = fixes(TrackerModel { outliers: 0.02, outlier_m: 3.0, outlier_rad: 0.1, ..tracker }, 4, 500_000);
    let (mut far, mut turned) = (Vec::new(), Vec::new());
    for ((k, fix), (_, clean)) in dirty.iter().zip(&clean) {
        // An outlier changes its own fix and no other fix's noise.
        if fix != clean {
            far.push(fix.position_m - clean.position_m);
            turned.push(rotation(moving(*k).attitude.conjugate() * fix.attitude));
        }
    }
    let (n, share) = (dirty.len() as f64, far.len() as f64 / dirty.len() as f64);
    assert!((share - 0.02).abs() < 5.0 * (0.02 * 0.98 / n).sqrt(), "{share}");
    assert_sigma(&coordinates(far), 3.0, "outliers");
    assert_sigma(&coordinates(turned), (0.1_f64.powi(2) + 0.004_f64.powi(2)).sqrt(), "turned outliers");
}

#[test]
fn the_frame_is_shifted_and_turned() {
    let (frame_m, frame_yaw_rad) = (Vector3::new(1.0, 2.0, -0.5), 0.7);
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.7);
    for (k, fix) in fixes(TrackerModel { frame_m, frame_yaw_rad, ..TrackerModel::DEFAULT }, 5, 1000) {
        let truth = moving(k);
        assert!((fix.position_m - (turn * truth.position_m + frame_m)).norm() < 1e-9);
        let expected: Quaternion<f64> = turn.into_inner() * truth.attitude;
        assert!((fix.attitude - expected).norm() < 1e-12);
    }
}

/// Dropouts and freezes take the share of time of a two-state chain. A frozen pose is an old one with a new stamp.
/// Neither changes the noise of other fixes.
#[test]
fn dropouts_lose_fixes_and_freezes_repeat_them() {
    let noisy = TrackerModel { position_m: 0.001, ..TrackerModel::DEFAULT };
    let chain = MeasurementDropouts { rate_hz: 0.5, mean_s: 0.2 };
    let all = fixes(noisy, 6, 2_000_000);
    let share = |count: usize| {
        let (begins, ends) = (1.0 - (-0.5 * STEP_S).exp(), 1.0 - (-STEP_S / 0.2).exp());
        let (p, r) = (begins / (begins + ends), 1.0 - begins - ends);
        let found = count as f64 / all.len() as f64;
        let bound = 5.0 * (p * (1.0 - p) / 2e6 * (1.0 + r) / (1.0 - r)).sqrt();
        assert!((found - p).abs() < bound, "{found}, not {p} within {bound}");
    };
    let lossy = fixes(TrackerModel { loss: chain, ..noisy }, 6, 2_000_000);
    let mut kept = all.iter();
    assert!(lossy.iter().all(|fix| kept.any(|other| other == fix)), "what arrives is as without dropouts");
    share(all.len() - lossy.len());

    let frozen = fixes(TrackerModel { freeze: chain, ..noisy }, 6, 2_000_000);
    assert_eq!(frozen.len(), all.len());
    let mut count = 0;
    for i in 1..all.len() {
        let ((k, fix), (_, true_one)) = (frozen[i], all[i]);
        assert_eq!(fix.true_at_s, f64::from(k) * STEP_S);
        if fix != true_one {
            count += 1;
            assert_eq!((fix.position_m, fix.attitude), (frozen[i - 1].1.position_m, frozen[i - 1].1.attitude));
        }
    }
    share(count);
}

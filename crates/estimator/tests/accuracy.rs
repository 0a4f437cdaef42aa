//! Accuracy against the truth with the noise of an ICM-42688-P, and after a loss of the tracker.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)] // tests

use crate::common::{Flight, ICM, MOCAP, OUTDOOR, Rms, double, eight, exp, fly, hover, log, matrix, settings};
use afbc_estimator::{Measurement, Settings};

/// Root mean square errors.
#[derive(Default)]
struct Errors {
    horizontal: Rms,
    position: Rms,
    velocity: Rms,
    attitude: Rms,
    heading: Rms,
}

fn measure(sensors: crate::common::Sensors, settings: Settings, seeds: u64) -> Errors {
    let truth = fly(eight, 30.0);
    let mut errors = Errors::default();
    for seed in 0..seeds {
        let mut flight = Flight::with(&truth, ICM, sensors, 77 + seed, settings);
        for ms in 0..30_000 {
            let estimate = flight.step();
            // The estimate is compared after 10 s with the truth at the same moment, because it describes the present.
            if ms >= 10_000 {
                let validity = estimate.validity;
                assert!(validity.attitude && validity.heading && validity.velocity && validity.position, "{ms} ms");
                let e = flight.errors(&estimate);
                errors.horizontal.add(e.fixed_rows::<2>(6).norm());
                errors.position.add(e.fixed_rows::<3>(6).norm());
                errors.velocity.add(e.fixed_rows::<3>(3).norm());
                errors.attitude.add(e.fixed_rows::<3>(0).norm().to_degrees());
                errors.heading.add(e[2].to_degrees());
            }
        }
    }
    errors
}

/// The accuracy with motion capture is tested with the settings of the bare sensor, and with the defaults for any
/// vehicle.
#[test]
fn motion_capture() {
    for (name, settings) in [("part", settings(&ICM)), ("default", Settings::DEFAULT)] {
        let errors = measure(MOCAP, settings, 3);
        let (p, v, a) = (errors.position.value(), errors.velocity.value(), errors.attitude.value());
        println!("motion capture, settings of {name}: {p:.5} m, {v:.4} m/s, {a:.3} deg");
        assert!(p < 0.003 && v < 0.02 && a < 0.3, "{name}: {p} m, {v} m/s, {a} deg");
    }
}

#[test]
fn outdoor() {
    for (name, settings) in [("part", settings(&ICM)), ("default", Settings::DEFAULT)] {
        let errors = measure(OUTDOOR, settings, 5);
        let (p, v) = (errors.horizontal.value(), errors.velocity.value());
        let (a, h) = (errors.attitude.value(), errors.heading.value());
        println!("outdoor, settings of {name}: horizontal {p:.3} m, {v:.3} m/s, {a:.3} deg, heading {h:.3} deg");
        // The receiver's own error is 0.8 m in x and in y.
        assert!(p < 0.5 * 0.8 * 2.0_f64.sqrt() && v < 0.15 && a < 1.0 && h < 3.0, "{p} m, {v} m/s, {a} deg, {h} deg");
    }
}

/// Takes the tracker away for `gap_ms` in hover, and returns the largest position error.
fn without_tracker(gap_ms: usize, seed: u64, settings: Settings) -> f64 {
    let truth = fly(hover, 20.0);
    let mut flight = Flight::with(&truth, ICM, MOCAP, seed, settings);
    let start = afbc_types::State {
        position_m: crate::common::single(&truth[0].p),
        attitude_rad: nalgebra::Vector3::new(0.0, 0.0, 0.1),
        ..Default::default()
    };
    let sigmas = afbc_estimator::Sigmas {
        attitude_rad: nalgebra::Vector3::repeat(0.05),
        velocity_m_s: nalgebra::Vector3::repeat(0.1),
        position_m: nalgebra::Vector3::repeat(0.05),
        gyro_bias_rad_s: nalgebra::Vector3::repeat(0.01),
        accel_bias_m_s2: nalgebra::Vector3::repeat(0.1),
        height_offset_m: 0.0,
    };
    assert!(flight.estimator.start_at(&mut flight.memory, 1_000_000, &start, &sigmas));
    let mut worst: f64 = 0.0;
    let mut before = nalgebra::Vector3::zeros();
    for ms in 0..18_000 {
        let gone = (12_000..12_000 + gap_ms).contains(&ms);
        let estimate = flight.step_with(|_| true, |_| !gone);
        let error = flight.errors(&estimate).fixed_rows::<3>(6).norm();
        if gone {
            worst = worst.max(error);
            let sigma = double(&estimate.sigmas.position_m).norm();
            assert!(error < 5.0 * sigma + 1e-3, "{ms} ms: {error} m, but sigma {sigma} m");
            assert!(estimate.validity.position, "{ms} ms");
        }
        // The position is right again at once, without a reset.
        if ms > 12_000 + gap_ms + 100 {
            assert!(error < 0.005, "{ms} ms: {error} m");
            assert_eq!(estimate.resets.position, 0);
        }
        if ms == 17_999 {
            before = estimate.state.position_m;
        }
    }
    assert!((double(&before) - flight.moment().p).norm() < 0.005);
    worst
}

#[test]
fn the_tracker_is_gone_in_hover() {
    let (mut one, mut three) = (0.0_f64, 0.0_f64);
    for settings in [settings(&ICM), Settings::DEFAULT] {
        for seed in 0..20 {
            one = one.max(without_tracker(1000, seed, settings));
            three = three.max(without_tracker(3000, seed, settings));
        }
    }
    println!("largest error without tracker: {one:.4} m after 1 s, {three:.4} m after 3 s");
    assert!(one < 0.2 && three < 1.5, "{one} m, {three} m");
}

/// A tracker may be 250 ms late. On the figure of eight, the vehicle has moved half a metre by then.
#[test]
fn a_late_tracker() {
    let truth = fly(eight, 16.0);
    let mut flight = Flight::new(&truth, ICM, MOCAP, 5);
    // The tracker itself is 8 to 12 ms late. This delay is added.
    flight.late_ms = 238.0;
    let (mut position, mut behind) = (Rms::default(), Rms::default());
    for ms in 0..16_000 {
        let estimate = flight.step();
        if ms > 8000 {
            position.add(flight.errors(&estimate).fixed_rows::<3>(6).norm());
            behind.add((flight.moment().p - truth[ms - 248].p).norm());
        }
    }
    let (error, behind) = (position.value(), behind.value());
    println!("tracker 248 ms late: {error:.4} m, where the vehicle was {behind:.2} m behind");
    assert!(behind > 0.4 && error < 0.005, "{error} m, {behind} m");
    assert_eq!((flight.memory.aids().tracker_position.rejected, flight.memory.dropped().crowded), (0, 0));
    assert!(flight.memory.aids().tracker_position.accepted > 1300);
}

/// A heading that no sensor measures is found by flying, from an error of two radians. From positions alone it never
/// becomes valid, since an error of three radians might stay. From a receiver's velocity it does.
#[test]
fn an_untold_heading() {
    let truth = fly(|t| (eight(t).0, eight(t).1 - 2.0), 20.0);
    for (sensors, most) in [(MOCAP, 0.01), (crate::common::Sensors { mag: None, ..OUTDOOR }, 0.05)] {
        let mut flight = Flight::new(&truth, ICM, sensors, 6);
        for ms in 0..20_000 {
            let estimate = flight.step_with(
                |_| true,
                |measurement| {
                    if let Measurement::Pose { position_m, position_sigma_m: sigma_m, .. } = measurement.value {
                        measurement.value = Measurement::Position { position_m, sigma_m };
                    }
                    true
                },
            );
            let heading = flight.errors(&estimate)[2].abs();
            assert!(ms < 15_000 || heading < most, "{ms} ms: {heading} rad");
            let valid = estimate.validity.heading;
            assert!(!valid || sensors.gnss.is_some() && heading < 0.3, "{ms} ms: {heading} rad");
            assert!(valid || sensors.gnss.is_none() || ms < 12_000, "{ms} ms");
        }
    }
}

/// On the ground without any aid the filter holds velocity and biases if told so; otherwise they drift.
#[test]
fn on_the_ground() {
    let truth = fly(crate::common::rest, 120.0);
    let nothing = crate::common::Sensors::default();
    let mut drifts = [0.0, 0.0];
    for (on_ground, drift) in [true, false].into_iter().zip(&mut drifts) {
        let mut flight = Flight::new(&truth, ICM, nothing, 8);
        flight.memory.set_on_ground(on_ground);
        let mut last = flight.step();
        for _ in 1..120_000 {
            last = flight.step();
        }
        assert_eq!(last.validity.velocity, on_ground);
        assert!(last.validity.attitude);
        *drift = flight.errors(&last).fixed_rows::<3>(3).norm();
        let gyro = flight.errors(&last).fixed_rows::<2>(9).norm();
        assert!(!on_ground || gyro < 1e-4, "{gyro} rad/s");
    }
    assert!(drifts[0] < 0.02 && drifts[1] > 5.0 * drifts[0], "{drifts:?} m/s");
}

/// At a kilometre an `f32` position has steps of 0.06 mm, and a slow vehicle must still move.
#[test]
fn far_away_and_slow() {
    let truth = fly(|t| (nalgebra::Vector3::new(2000.0 + 0.02 * t, -1500.0, 50.0), 0.0), 15.0);
    let mut flight = Flight::new(&truth, ICM, MOCAP, 5);
    let mut velocity = Rms::default();
    for ms in 0..15_000 {
        let estimate = flight.step();
        if ms > 8000 {
            velocity.add(f64::from(estimate.state.velocity_m_s.x) - 0.02);
        }
    }
    let value = velocity.value();
    assert!(value < 0.005, "{value} m/s");
}

/// Checks the rotation functions of the tests themselves.
#[test]
fn rotations() {
    let v = nalgebra::Vector3::new(0.3, -0.5, 0.9);
    assert!((log(&exp(&v)) - v).norm() < 1e-12);
    assert!((matrix(crate::common::quaternion(&exp(&v))) - exp(&v)).norm() < 1e-6);
}

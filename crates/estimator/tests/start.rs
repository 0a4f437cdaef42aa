//! The filter starts by itself at rest or reports why not, and starts in the air in a given state.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)] // tests

use crate::common::checks::{at_rest, position_error, sound};
use crate::common::{Flight, ICM, MOCAP, NOTHING, OUTDOOR, eight, fly, settings, single};
use afbc_estimator::{ImuSample, Sigmas, Unready};
use afbc_types::State;
use nalgebra::Vector3;

#[test]
fn starts_at_rest_level_and_unbiased() {
    let (estimate, _) = at_rest(1500, OUTDOOR, |_, _| ());
    assert_eq!(estimate.unready, None);
    let v = estimate.validity;
    assert!(v.attitude && v.heading, "{v:?}");
    // The tilt is as good as the accelerometer bias, the heading as good as field and tilt.
    assert!(estimate.state.attitude_rad.xy().norm() < 0.03 && (estimate.state.attitude_rad.z - 0.3).abs() < 0.08);
    // Without a sensor for it, the heading is not valid.
    let (estimate, _) = at_rest(1500, NOTHING, |_, _| ());
    assert_eq!(estimate.unready, None);
    assert!(estimate.validity.attitude && !estimate.validity.heading && !estimate.validity.position);
    assert!(estimate.sigmas.attitude_rad.z > 1.0);
}

#[test]
fn tells_why_it_does_not_start() {
    let why = |change: &dyn Fn(usize, &mut ImuSample)| at_rest(3000, NOTHING, change).0.unready;
    assert_eq!(why(&|_, _| ()), None);
    // The vehicle is carried about, with a slow swing and a turn about the vertical.
    let swing = |ms: usize, s: &mut ImuSample| {
        let (sine, cosine) = (ms as f32 * 2e-3).sin_cos();
        s.rates_rad_s.x += 0.2 * cosine;
        s.specific_force_m_s2.y += 9.81 * (0.1 * sine).sin();
    };
    assert_eq!(why(&swing), Some(Unready::Moving));
    let turn = |ms: usize, s: &mut ImuSample| s.rates_rad_s.z += 0.2 * (ms as f32 * 3e-3).cos();
    assert_eq!(why(&turn), Some(Unready::Moving));
    assert_eq!(why(&|ms, s| s.specific_force_m_s2.y += (ms as f32 * 5e-3).sin()), Some(Unready::Moving));
    assert_eq!(why(&|ms, s| s.specific_force_m_s2.x += ms as f32 * 5e-4), Some(Unready::Moving));
    assert_eq!(why(&|_, s| s.rates_rad_s.z += 0.5), Some(Unready::Turning));
    assert_eq!(why(&|_, s| s.specific_force_m_s2 *= 0.8), Some(Unready::NotGravity));
    assert_eq!(why(&|_, s| s.specific_force_m_s2 = Vector3::new(9.0, 0.0, 3.9)), Some(Unready::Tilted));
    assert_eq!(why(&|_, s| s.specific_force_m_s2 = Vector3::new(0.0, 0.0, -9.81)), Some(Unready::Tilted));
    assert_eq!(why(&|_, s| s.rates_rad_s.x = f32::NAN), Some(Unready::NoImu));
    assert_eq!(at_rest(500, NOTHING, |_, _| ()).0.unready, Some(Unready::Settling));
    // The filter starts a second after the motion has ended.
    assert_eq!(
        at_rest(3400, NOTHING, |ms, s| if ms < 2000 {
            swing(ms, s)
        })
        .0
        .unready,
        None
    );
    for unready in [Unready::NoImu, Unready::Settling, Unready::Moving, Unready::Turning, Unready::Tilted] {
        assert!(unready.to_string().len() > 20);
    }
}

#[test]
fn starts_in_flight_where_it_is_told() {
    let truth = fly(eight, 20.0);
    let mut flight = Flight::with(&truth, ICM, MOCAP, 2, settings(&ICM));
    flight.now = 8000;
    let sigmas = |v: f32| Sigmas {
        attitude_rad: Vector3::repeat(0.1),
        velocity_m_s: Vector3::repeat(v),
        position_m: Vector3::repeat(0.1),
        gyro_bias_rad_s: Vector3::repeat(0.02),
        accel_bias_m_s2: Vector3::repeat(0.2),
        height_offset_m: 0.0,
    };
    let moment = truth[8000];
    let rotation = nalgebra::Rotation3::from_matrix_unchecked(moment.r);
    let (roll, pitch, yaw) = rotation.euler_angles();
    let state = State {
        position_m: single(&moment.p),
        velocity_m_s: single(&moment.v),
        attitude_rad: Vector3::new(roll as f32 + 0.05, pitch as f32 - 0.05, yaw as f32),
        ..State::default()
    };
    let now_us = flight.now_us();
    assert!(!flight.estimator.start_at(&mut flight.memory, now_us, &state, &sigmas(f32::NAN)));
    assert!(!flight.memory.runs());
    assert!(flight.estimator.start_at(&mut flight.memory, now_us, &state, &sigmas(0.2)));
    for ms in 8000..19_000 {
        let estimate = flight.step();
        sound(&estimate, &flight.memory);
        assert!(ms > 8000 || estimate.validity.attitude);
        if ms > 11_000 {
            assert!(position_error(&estimate, &flight) < 0.005, "{ms} ms");
            assert_eq!(estimate.resets, Default::default());
        }
    }
}

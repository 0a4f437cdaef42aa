//! A vehicle at rest stays in place, and a vehicle that is moved is followed.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)] // tests

use crate::common::{Flight, ICM, Imu, MOCAP, NOTHING, OUTDOOR, Path, V3, eight, fly, hover, rest, settings};
use afbc_estimator::Settings;

/// IMU of a simulator: 0.0004 rad/s and 0.002 m/s2 per root of a hertz.
const COARSE: Imu = Imu { gyro: 4e-4, accel: 2e-3, ..ICM };

/// Returns a smooth step from 0 to 1 between `from` and `to`.
fn step(t: f64, from: f64, to: f64) -> f64 {
    let x = ((t - from) / (to - from)).clamp(0.0, 1.0);
    x * x * x * x * (35.0 - 84.0 * x + 70.0 * x * x - 20.0 * x * x * x)
}

/// Returns the distance at a speed that grows from 0 at 4 s to 1 at 6 s.
fn begun(t: f64) -> f64 {
    let x = ((t - 4.0) / 2.0).clamp(0.0, 1.0);
    2.0 * x * x * x * x * (2.5 - 3.0 * x + x * x) + (t - 6.0).max(0.0)
}

/// Without any aid, velocity, position and tilt do not drift, whether the filter is told that the motors are off or
/// nothing.
#[test]
fn it_stays_where_it_is() {
    let truth = fly(rest, 60.0);
    for (imu, told, seed) in [(ICM, None, 1), (ICM, Some(true), 2), (COARSE, None, 3), (COARSE, Some(true), 4)] {
        for settings in [settings(&imu), Settings::DEFAULT] {
            let mut flight = Flight::with(&truth, imu, NOTHING, seed, settings);
            told.into_iter().for_each(|told| flight.memory.set_on_ground(told));
            let mut start = None;
            for ms in 0..60_000 {
                let estimate = flight.step();
                if ms < 2000 {
                    continue;
                }
                assert!(estimate.at_rest && estimate.validity.velocity && !estimate.validity.position, "{ms} ms");
                let state = &estimate.state;
                let (_, first) = *start.get_or_insert((ms, state.attitude_rad));
                let (speed, away) = (state.velocity_m_s.norm(), state.position_m.norm());
                // The accelerometer bias of 0.1 m/s2 along the vertical appears first as a velocity.
                let most = if ms < 4000 { 0.05 } else { 0.02 };
                assert!(speed < most && away < 0.1, "seed {seed}, {ms} ms: {speed} m/s, {away} m");
                let turned = (state.attitude_rad - first).xy().norm().to_degrees();
                assert!(turned < 0.2, "seed {seed}, {ms} ms: {turned} degrees");
            }
        }
    }
}

/// Carries the vehicle by 3 m and half a turn, with a tremor of this amplitude.
fn carried(t: f64, time_s: f64, tremor_m: f64) -> (V3, f64) {
    let x = step(t, 4.0, 4.0 + time_s);
    let shakes = 4.0 * x * (1.0 - x) * tremor_m;
    let shake = V3::new((38.0 * t).sin(), (31.0 * t).cos(), (45.0 * t).sin()) * shakes;
    (V3::new(2.5, -1.5, 0.8) * x + V3::z() * (0.8 * 4.0 * x * (1.0 - x)) + shake, 3.0 * x)
}

fn quickly(t: f64) -> (V3, f64) {
    carried(t, 2.0, 0.0)
}

fn gently(t: f64) -> (V3, f64) {
    carried(t, 10.0, 0.0)
}

fn with_a_tremor(t: f64) -> (V3, f64) {
    carried(t, 6.0, 5e-4)
}

/// A hand moves the vehicle with its motors off: the filter does not hold it, and holds it again at the new place
/// without a velocity jump. The errors fit the stated covariance.
#[test]
fn a_hand_moves_it() {
    for (path, moves_s) in [(quickly as Path, 2.0), (gently as Path, 10.0), (with_a_tremor as Path, 6.0)] {
        let truth = fly(path, 20.0);
        for (sensors, told) in [(OUTDOOR, Some(true)), (OUTDOOR, None), (MOCAP, Some(true)), (NOTHING, Some(true))] {
            for seed in 0..4 {
                let mut flight = Flight::with(&truth, ICM, sensors, seed, settings(&ICM));
                told.into_iter().for_each(|told| flight.memory.set_on_ground(told));
                let name = |ms: usize| format!("{moves_s} s, {told:?}, seed {seed}, {ms} ms");
                let mut place = 0.0;
                for ms in 0..20_000 {
                    let estimate = flight.step();
                    let moves = 4.0..4.0 + moves_s;
                    let t = ms as f64 * 1e-3;
                    if t < 2.0 {
                        continue;
                    }
                    // Motion is noticed before the vehicle is fast, and rest not before the motion ends.
                    let speed = flight.moment().v.norm();
                    assert!(!(estimate.at_rest && speed > 0.15), "{}: at rest at {speed} m/s", name(ms));
                    let settled = !(moves.start..moves.end + 2.0).contains(&t);
                    let rests = told.is_some() || t < 4.0;
                    assert!(!settled || estimate.at_rest == rests, "{}", name(ms));
                    let (e, p) = (flight.errors(&estimate), flight.covariance());
                    place = e.fixed_rows::<3>(6).norm();
                    // Without an aid the position is lost until the vehicle stands again.
                    let lost = sensors.gnss.or(sensors.tracker.map(|(p, a)| (p, p, a))).is_none();
                    let velocity = e.fixed_rows::<3>(3).norm();
                    assert!(velocity < 0.3 || lost && !settled, "{}: off by {velocity} m/s", name(ms));
                    for k in (0..2).chain(3..6) {
                        let sigmas = e[k].abs() / p[(k, k)].sqrt();
                        assert!(sigmas < 5.5, "{}: error {k} is {} with {sigmas} sigma", name(ms), e[k]);
                    }
                    let kick = estimate.moved_m_s.norm();
                    assert!(t < 4.0 || kick < 0.1 || lost, "{}: the velocity jumps by {kick} m/s", name(ms));
                }
                let bound = match (sensors.tracker, sensors.gnss) {
                    (Some(_), _) => 0.01,
                    (None, Some(_)) => 0.8,
                    (None, None) => 0.5,
                };
                assert!(place < bound, "{}: {place} m", name(20_000));
            }
        }
    }
}

/// A cart drives straight on at walking speed, motors off: the IMU shows rest, but the receiver shows motion.
#[test]
fn a_cart_moves_it() {
    let truth = fly(|t| (V3::new(0.9, 0.4, 0.0) * begun(t), 0.0), 14.0);
    for seed in 0..4 {
        let mut flight = Flight::with(&truth, ICM, OUTDOOR, seed, settings(&ICM));
        flight.memory.set_on_ground(true);
        for ms in 0..14_000 {
            let estimate = flight.step();
            let velocity = flight.errors(&estimate).fixed_rows::<3>(3).norm();
            assert!(ms < 2000 || velocity < 0.3, "seed {seed}, {ms} ms: {velocity} m/s");
            assert!(ms < 5000 || !estimate.at_rest, "seed {seed}, {ms} ms");
        }
    }
}

/// A vehicle that hovers or flies straight in calm air looks like one at rest. Without ground information it is not
/// held once it has moved; with motors turning it is never held.
#[test]
fn a_hover_is_no_rest() {
    fn cruise(t: f64) -> (V3, f64) {
        (V3::new(0.4, 0.0, 0.2) * begun(t), 0.0)
    }
    for (path, told, from) in [
        (cruise as Path, None, 5000),
        (cruise as Path, Some(false), 0),
        (hover as Path, Some(false), 0),
        (eight, None, 4000),
    ] {
        let truth = fly(path, 20.0);
        for sensors in [OUTDOOR, NOTHING] {
            let mut flight = Flight::with(&truth, ICM, sensors, 5, settings(&ICM));
            told.into_iter().for_each(|told| flight.memory.set_on_ground(told));
            for ms in 0..20_000 {
                let estimate = flight.step();
                assert!(ms < from || !estimate.at_rest, "{told:?}, {ms} ms");
            }
        }
    }
}

//! Checks the small parts against independent formulas: rotations, geodetic conversion, queue, gates, filters,
//! plausibility.

extern crate std;

use super::{V3, numbers, vector};
use crate::aid::{AidRecord, AidRecords, AidSource, FrozenPoseDetector, ResetDelay, passes};
use crate::covariance::{Covariance, angle_variance, largest_sigma};
use crate::geodetic::GeodeticOrigin;
use crate::history::{PastState, StateHistory};
use crate::imu::{ClippedSensors, ImuMonitor, LowPassFilter2p, LowPassFilter2pMemory, MISSING_US};
use crate::measurement::{ImuSample, Measurement};
use crate::memory::Memory;
use crate::nominal::NominalState;
use crate::queue::MeasurementQueue;
use crate::rotation::{about_z, difference, identity, levelling, matrix, normalized, renormalized, small, yaw_between};
use crate::settings::Settings;
use afbc_types::Stamped;
use nalgebra::{Quaternion, Rotation3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use std::vec::Vec;

fn single(q: &UnitQuaternion<f64>) -> Quaternion<f32> {
    Quaternion::from(q.into_inner().coords.map(|x| x as f32))
}

/// Returns the angle between two rotations \[rad\].
fn apart(ours: &Quaternion<f32>, theirs: &UnitQuaternion<f64>) -> f64 {
    let ours = UnitQuaternion::from_quaternion(Quaternion::from(ours.coords.map(f64::from)));
    ours.angle_to(theirs)
}

proptest! {
    #[test]
    fn rotations_of_any_size(turn in numbers::<3>(), other in numbers::<3>(), far in 0.0..6.0_f64) {
        let turn = vector(turn) * far;
        let exact = UnitQuaternion::new(turn);
        let ours = small(&turn.map(|x| x as f32));
        prop_assert!(apart(&ours, &exact) < 3e-6 && (ours.norm() - 1.0).abs() < 1e-6, "{turn}");
        let dense = exact.to_rotation_matrix().into_inner();
        prop_assert!((matrix(&ours).map(f64::from) - dense).abs().max() < 5e-6);
        // `normalized` accepts any norm, and `renormalized` a norm close to one.
        prop_assert!((normalized(&(ours * 3.0)) - ours).norm() < 1e-6);
        prop_assert!((renormalized(&(ours * 1.01)).norm() - 1.0).abs() < 2e-4);
        let from = UnitQuaternion::new(vector(other) * 3.0);
        let by = vector(other) * 1.7;
        let to = UnitQuaternion::new(by) * from;
        let found = difference(&single(&to), &single(&from)).map(f64::from);
        prop_assert!((found - by).norm() < 5e-6 * (1.0 + by.norm()), "{found}, not {by}");
        let negative = difference(&-single(&to), &single(&from)).map(f64::from);
        prop_assert!((negative - by).norm() < 5e-6 * (1.0 + by.norm()));
        // Twist about the vertical, ignoring the tilt.
        let yaw = other[0] * 3.1;
        let about = UnitQuaternion::new(V3::z() * yaw);
        prop_assert!(apart(&about_z(yaw as f32), &about) < 1e-6);
        prop_assert!((f64::from(yaw_between(&single(&(about * from)), &single(&from))) - yaw).abs() < 2e-5);
    }

    /// Levelling turns the given direction to vertical by the shortest way.
    #[test]
    fn levelling_is_the_shortest_turn(x in numbers::<3>()) {
        let up = vector(x).try_normalize(1e-3);
        prop_assume!(up.is_some());
        let up = up.unwrap();
        match levelling(&up.map(|x| x as f32)) {
            None => prop_assert!(up.z < -0.98),
            Some(turn) => {
                let turn = UnitQuaternion::from_quaternion(Quaternion::from(turn.coords.map(f64::from)));
                prop_assert!((turn * up - V3::z()).norm() < 1e-5 * (1.0 + 1.0 / (1.0 + up.z)));
                prop_assert!((turn.angle() - up.z.acos()).abs() < 2e-3 && up.z > -0.991);
            }
        }
    }

    /// Compares local coordinates with the tangent plane, computed via the earth's centre.
    #[test]
    fn places_are_those_on_the_ellipsoid(
        latitude in -85.0..85.0_f64, longitude in -180.0..180.0_f64, altitude in -400.0..8000.0_f64,
        by in numbers::<3>(),
    ) {
        let centred = |latitude: f64, longitude: f64, altitude: f64| {
            let (sine, cosine) = latitude.to_radians().sin_cos();
            let (east, level) = longitude.to_radians().sin_cos();
            let square = 6.694_379_990_14e-3;
            let radius = 6_378_137.0 / (1.0 - square * sine * sine).sqrt();
            V3::new(
                (radius + altitude) * cosine * level,
                (radius + altitude) * cosine * east,
                (radius * (1.0 - square) + altitude) * sine,
            )
        };
        let origin = GeodeticOrigin::new(latitude, longitude, altitude).unwrap();
        let there = (latitude + by[0] * 0.01, longitude + by[1] * 0.01, altitude + by[2] * 100.0);
        let turns = if there.1 > 180.0 { 1.0 } else if there.1 < -180.0 { -1.0 } else { 0.0 };
        let wrapped = there.1 - 360.0 * turns;
        let ours = origin.local(there.0, wrapped, there.2).map(f64::from);
        let away = centred(there.0, there.1, there.2) - centred(latitude, longitude, altitude);
        let (sine, cosine) = latitude.to_radians().sin_cos();
        let (east, level) = longitude.to_radians().sin_cos();
        let north = V3::new(-sine * level, -sine * east, cosine).dot(&away);
        let west = -V3::new(-east, level, 0.0).dot(&away);
        prop_assert!((ours.x - north).abs() < 2.0 && (ours.y - west).abs() < 2.0, "{ours}, not {north}, {west}");
        prop_assert!((ours.z - by[2] * 100.0).abs() < 1e-3);
    }

    /// Hermite interpolation reproduces a cubic between two entries exactly.
    #[test]
    fn what_is_between_entries_is_a_cubic(c in numbers::<12>(), span_us in 4_000..60_000_u32, share in 0.05..0.95_f64) {
        let of = |k: usize, t: f64| {
            let part = |i: usize| V3::new(c[i], c[i + 1], c[i + 2]);
            let (a, b, d, e) = (part(0), part(3) * 20.0, part(6) * 300.0, part(9) * 4000.0);
            match k {
                0 => a + b * t + d * (t * t) + e * (t * t * t),
                _ => b + d * (2.0 * t) + e * (3.0 * t * t),
            }
        };
        let turn = |t: f64| UnitQuaternion::new(V3::new(c[0], c[5], c[9]) * (0.5 * t));
        let mut history = StateHistory::default();
        let base = u32::MAX - span_us / 2;
        for (step, t) in [(0, 0.0), (span_us, f64::from(span_us) * 1e-6)] {
            let (velocity, position) = (of(1, t).map(|x| x as f32), of(0, t).map(|x| x as f32));
            let at_us = base.wrapping_add(step);
            history.store(&PastState { at_us, attitude: single(&turn(t)), velocity, position });
        }
        let after_us = (f64::from(span_us) * share) as u32;
        let t = f64::from(after_us) * 1e-6;
        let found = history.at(base.wrapping_add(after_us)).unwrap();
        prop_assert!((found.position.map(f64::from) - of(0, t)).norm() < 2e-6 * (2.0 + of(0, t).norm()));
        // The velocity is linear between the two entries.
        let ends = of(1, 0.0).lerp(&of(1, f64::from(span_us) * 1e-6), f64::from(after_us) / f64::from(span_us));
        prop_assert!((found.velocity.map(f64::from) - ends).norm() < 1e-5 * (2.0 + ends.norm()));
        prop_assert!(apart(&found.attitude, &turn(t)) < 1e-5);
        prop_assert!((found.attitude.norm() - 1.0).abs() < 1e-6 && found.at_us == base.wrapping_add(after_us));
    }

    /// For any order of times: the oldest arrival that is due leaves first, and a ninth measurement drops the oldest.
    #[test]
    fn the_queue_is_a_queue(events in proptest::collection::vec((any::<bool>(), 0..20_u64, 0..25_u64), 1..60)) {
        let (mut queue, mut model) = (MeasurementQueue::default(), Vec::new());
        for (pushes, at_us, limit_us) in events {
            if pushes {
                let value = Measurement::Heading { heading_rad: model.len() as f32, sigma_rad: 0.1 };
                let timed = Stamped { value, at_us };
                prop_assert_eq!(queue.push(&timed), model.len() == 8);
                if model.len() == 8 {
                    model.remove(0);
                }
                model.push(timed);
            } else {
                let due = model.iter().position(|timed: &Stamped<Measurement>| timed.at_us <= limit_us);
                let taken = queue.take(|at_us| at_us <= limit_us);
                prop_assert_eq!(taken, due.map(|due| model.remove(due)));
            }
            prop_assert_eq!(usize::from(queue.waiting()), model.len());
        }
    }

    /// Integration of linearly changing rates and force, with coning, agrees with a fine integration to second order.
    #[test]
    fn the_nominal_state_follows_the_samples(w in numbers::<3>(), f in numbers::<3>(), slope in numbers::<6>()) {
        let biases = (Vector3::new(0.01_f32, -0.02, 0.03), Vector3::new(0.2_f32, -0.1, 0.15));
        let rates = |t: f64| vector(w) * 3.0 + V3::new(slope[0], slope[1], slope[2]) * (100.0 * t);
        let grows = V3::new(slope[3], slope[4], slope[5]) * 30.0;
        let force = |t: f64| vector(f) * 5.0 + V3::new(0.0, 0.0, 9.8) + grows * t;
        let start = UnitQuaternion::new(V3::new(0.2, -0.1, 0.4));
        let mut nominal = NominalState::new(single(&start));
        (nominal.gyro_bias, nominal.accel_bias) = biases;
        nominal.velocity = Vector3::new(1.0, -2.0, 0.5);
        nominal.move_to(Vector3::new(3.0, 4.0, 5.0));
        let sample = |t: f64| ImuSample {
            at_us: 0,
            rates_rad_s: rates(t).map(|x| x as f32) + biases.0,
            specific_force_m_s2: force(t).map(|x| x as f32) + biases.1,
        };
        nominal.begin(&sample(0.0));
        let mut thrust = Vector3::zeros();
        for i in 1..=25 {
            thrust += nominal.advance(&sample(f64::from(i) * 4e-3), 4e-3, 9.81);
        }
        let (mut q, mut v, mut p, mut s) = (start, V3::new(1.0, -2.0, 0.5), V3::new(3.0, 4.0, 5.0), V3::zeros());
        let h = 2e-5;
        for i in 0..5000 {
            let t = (f64::from(i) + 0.5) * h;
            let middle = q * UnitQuaternion::new(rates(t) * (0.5 * h));
            let a = middle * force(t);
            p += v * h + (a - V3::z() * 9.81) * (0.5 * h * h);
            (v, s) = (v + (a - V3::z() * 9.81) * h, s + a * h);
            q *= UnitQuaternion::new(rates(t) * h);
        }
        prop_assert!(apart(&nominal.attitude, &q) < 1e-5, "{}", apart(&nominal.attitude, &q));
        prop_assert!((nominal.velocity.map(f64::from) - v).norm() < 5e-4);
        prop_assert!((thrust.map(f64::from) - s).norm() < 5e-4);
        prop_assert!((nominal.position.map(f64::from) - p).norm() < 5e-5);
        prop_assert!((nominal.rates.map(f64::from) - rates(0.1)).norm() < 1e-5);
    }
}

/// A motion of a fraction of the last bit per step is not lost.
#[test]
fn rounding_leaves_no_step_out() {
    let mut nominal = NominalState::new(identity());
    nominal.move_to(Vector3::new(4000.0, 0.0, 0.0));
    nominal.velocity = Vector3::new(0.05, 0.0, 0.0);
    let sample = ImuSample { specific_force_m_s2: Vector3::new(0.0, 0.0, 9.81), ..ImuSample::default() };
    nominal.begin(&sample);
    for _ in 0..10_000 {
        let _ = nominal.advance(&sample, 1e-3, 9.81);
    }
    assert!((nominal.position.x - 4000.5).abs() < 2e-3, "{}", nominal.position.x);
    nominal.move_by(&Vector3::new(1.0, 2.0, 3.0));
    assert!((nominal.position - Vector3::new(4001.5, 2.0, 3.0)).norm() < 4e-3);
}

#[test]
fn an_impossible_state_is_not_sound() {
    let mut good = NominalState::new(identity());
    (good.position, good.velocity) = (Vector3::new(8.9e4, -8.9e4, 8.9e4), Vector3::new(299.0, -299.0, 299.0));
    assert!(good.is_sound());
    let bad = |change: &dyn Fn(&mut NominalState)| {
        let mut nominal = good;
        change(&mut nominal);
        !nominal.is_sound()
    };
    for number in [f32::NAN, f32::INFINITY] {
        assert!(bad(&|n| n.position.y = number) && bad(&|n| n.velocity.z = number) && bad(&|n| n.rates.x = number));
        assert!(
            bad(&|n| n.gyro_bias.x = number) && bad(&|n| n.accel_bias.y = number) && bad(&|n| n.attitude.w = number)
        );
    }
    assert!(bad(&|n| n.position.z = -9.1e4) && bad(&|n| n.velocity.x = 301.0));
    assert!(bad(&|n| n.attitude *= 1.01) && bad(&|n| n.attitude *= 0.99) && !bad(&|n| n.attitude *= 1.003));
    let sound = |change: &dyn Fn(&mut Covariance)| {
        let mut covariance = Covariance::default();
        change(&mut covariance);
        covariance.is_sound()
    };
    assert!(sound(&|c| (c.tt.m11, c.vv.m22, c.pp.m33, c.gg.m11, c.aa.m22, c.bb) = (3.0, 1e4, 1e8, 0.2, 20.0, 1e8)));
    for number in [f32::NAN, f32::INFINITY] {
        assert!(!sound(&|c| c.tt.m22 = number) && !sound(&|c| c.vv.m33 = number) && !sound(&|c| c.pp.m11 = number));
        assert!(!sound(&|c| c.gg.m22 = number) && !sound(&|c| c.aa.m33 = number) && !sound(&|c| c.bb = number));
    }
    assert_eq!(largest_sigma(&Vector3::new(4.0, 9.0, 1.0)), 3.0);
    assert_eq!(largest_sigma(&Vector3::new(4.0, 1.0, 16.0)), 4.0);
    assert_eq!((angle_variance(2.0), angle_variance(1e6)), (2.0, 3.3));
}

/// The gain is 1/sqrt(1 + x^4) of an analogue Butterworth filter, with the frequency warped by the bilinear transform.
#[test]
fn the_low_pass_is_butterworths() {
    for cutoff_hz in [20.0, 120.0, 300.0_f32] {
        for ratio in [0.1, 0.5, 1.0, 1.5] {
            let (low_pass, mut memory) = (LowPassFilter2p::new(cutoff_hz), LowPassFilter2pMemory::default());
            let hz = f64::from(cutoff_hz) * ratio;
            if hz > 450.0 {
                continue;
            }
            let mut square = 0.0;
            for i in 0..6000 {
                let x = (core::f64::consts::TAU * hz * f64::from(i) * 1e-3).sin();
                low_pass.advance(&mut memory, &Vector3::new(1.0, x as f32, -x as f32));
                if i >= 2000 {
                    square += f64::from(memory.output.y * memory.output.y) / 4000.0;
                    assert!((memory.output.x - 1.0).abs() < 1e-4 && memory.output.z == -memory.output.y);
                }
            }
            let bent = |hz: f64| (core::f64::consts::PI * hz * 1e-3).tan();
            let x = bent(hz) / bent(f64::from(cutoff_hz));
            let (gain, expected) = ((2.0 * square).sqrt(), 1.0 / (1.0 + x.powi(4)).sqrt());
            assert!((gain - expected).abs() < 0.02, "{cutoff_hz} Hz, {ratio}: {gain}, not {expected}");
        }
    }
    // The first value passes unchanged; without a cutoff every value does.
    let mut memory = LowPassFilter2pMemory::default();
    LowPassFilter2p::new(50.0).advance(&mut memory, &Vector3::new(3.0, -2.0, 1.0));
    assert!((memory.output - Vector3::new(3.0, -2.0, 1.0)).norm() < 1e-5);
    for x in [1.0, -4.0_f32] {
        LowPassFilter2p::new(0.0).advance(&mut memory, &Vector3::repeat(x));
        assert_eq!(memory.output, Vector3::repeat(x));
    }
}

fn sample(at_us: u64, rate: f32, force: f32) -> ImuSample {
    let (rates_rad_s, specific_force_m_s2) = (Vector3::new(rate, 0.0, 0.0), Vector3::new(0.0, force, 9.81));
    ImuSample { at_us, rates_rad_s, specific_force_m_s2 }
}

#[test]
fn the_monitor_tells_what_it_sees() {
    let settings = Settings::DEFAULT;
    let stuck_us = 15_000;
    let mut monitor = ImuMonitor::default();
    assert!(monitor.health(5, &settings, stuck_us).missing && monitor.at_us().is_none());
    assert_eq!(monitor.take(&sample(1_000_000, 0.0, 0.0), &settings), ClippedSensors { gyro: false, accel: false });
    assert!(!monitor.health(1_000_000 + MISSING_US, &settings, stuck_us).missing);
    assert!(monitor.health(1_000_001 + MISSING_US, &settings, stuck_us).missing);
    // Repeated samples count as stuck after the set time, and no longer after the first change.
    for ms in 1..=15 {
        assert!(!monitor.repeats(&sample(1_000_000 + 1000 * ms, 0.0, 0.0), stuck_us));
        let _ = monitor.take(&sample(1_000_000 + 1000 * ms, 0.0, 0.0), &settings);
        assert!(!monitor.health(1_015_000, &settings, stuck_us).stuck, "{ms} ms");
    }
    let _ = monitor.take(&sample(1_016_000, 0.0, 0.0), &settings);
    assert!(
        monitor.health(1_016_000, &settings, stuck_us).stuck && !monitor.health(1_016_000, &settings, 16_000).stuck
    );
    assert!(monitor.repeats(&sample(1_017_000, 0.0, 0.0), stuck_us));
    for other in [sample(1_017_000, 1e-6, 0.0), sample(1_017_000, 0.0, 1e-6)] {
        assert!(!monitor.repeats(&other, stuck_us));
        let mut freed = monitor;
        let _ = freed.take(&other, &settings);
        assert!(!freed.health(1_017_000, &settings, stuck_us).stuck);
    }
    // A reading counts as clipped from 98 % of the range on, and is reported for 200 ms.
    for (rate, force, clips) in [
        (0.97, 0.0, false),
        (0.99, 0.0, true),
        (-0.99, 0.0, true),
        (0.0, 0.97, false),
        (0.0, 0.99, true),
        (0.0, -0.99, true),
    ] {
        let mut monitor = ImuMonitor::default();
        let sample = sample(1_000_000, rate * settings.gyro_range_rad_s, force * settings.accel_range_m_s2);
        let clipped = ClippedSensors { gyro: clips && rate != 0.0, accel: clips && force != 0.0 };
        assert_eq!(monitor.take(&sample, &settings), clipped, "{rate}, {force}");
        assert_eq!(monitor.health(1_000_000, &settings, stuck_us).clipped, clips);
        let _ = monitor.take(&super::parts::sample(1_199_000, 0.0, 0.0), &settings);
        assert_eq!(monitor.health(1_199_000, &settings, stuck_us).clipped, clips);
        let _ = monitor.take(&super::parts::sample(1_200_000, 0.0, 0.0), &settings);
        assert!(!monitor.health(1_200_000, &settings, stuck_us).clipped);
    }
    // After 500 refusals in a row the sample clock must have jumped.
    let mut monitor = ImuMonitor::default();
    for number in 1..=500 {
        monitor.refuse();
        assert_eq!(monitor.is_lost(), number == 500);
    }
    assert_eq!(monitor.health(0, &settings, stuck_us).refused, 500);
    let _ = monitor.take(&sample(1000, 0.0, 0.0), &settings);
    assert!(!monitor.is_lost() && monitor.at_us() == Some(1000));
    monitor.forget();
    assert_eq!(monitor.at_us(), None);
    // Root mean square of the changes from sample to sample.
    for (rate, force, noisy) in [(1.9, 0.0, false), (2.1, 0.0, true), (0.0, 39.0, false), (0.0, 41.0, true)] {
        let mut monitor = ImuMonitor::default();
        for ms in 0..2000_u64 {
            let sign = if ms.is_multiple_of(2) { 0.5 } else { -0.5 };
            let _ = monitor.take(&sample(1000 * ms, sign * rate, sign * force), &settings);
        }
        let health = monitor.health(2_000_000, &settings, stuck_us);
        assert_eq!(health.noisy, noisy, "{rate}, {force}");
        assert!((health.vibration_m_s2 - force).abs() < 0.01 * force + 1e-3, "{}", health.vibration_m_s2);
    }
}

/// An aid that contradicts the state is never followed while two agreeing aids hold the state, late while one does, and
/// soon if none does.
#[test]
fn what_two_agree_on_is_not_overruled() {
    use AidSource::{GnssHeight, GnssPosition, GnssVelocity, Heading, Height, TrackerAttitude, TrackerPosition};
    let trust = |aid: AidSource, live: &[AidSource], now_us| {
        let mut aids = AidRecords::default();
        live.iter().for_each(|live| aids.of_mut(*live).accept(1000));
        aids.reset_delay(aid, aids.gnss_velocity.is_live(now_us, 50), now_us, 50)
    };
    for (aid, live, expected) in [
        (TrackerPosition, &[GnssPosition][..], ResetDelay::Never),
        (TrackerPosition, &[GnssVelocity], ResetDelay::Late),
        (TrackerPosition, &[Height, Heading], ResetDelay::Soon),
        (GnssPosition, &[TrackerPosition], ResetDelay::Never),
        (GnssPosition, &[GnssVelocity, Height], ResetDelay::Late),
        (GnssPosition, &[Height], ResetDelay::Soon),
        (GnssHeight, &[GnssVelocity, Height], ResetDelay::Never),
        (GnssHeight, &[TrackerPosition], ResetDelay::Never),
        (GnssHeight, &[GnssVelocity, GnssPosition], ResetDelay::Late),
        (GnssHeight, &[Height], ResetDelay::Soon),
        (GnssVelocity, &[TrackerPosition], ResetDelay::Never),
        (GnssVelocity, &[GnssPosition], ResetDelay::Late),
        (GnssVelocity, &[Height], ResetDelay::Soon),
        (TrackerAttitude, &[Heading], ResetDelay::Never),
        (TrackerAttitude, &[TrackerPosition], ResetDelay::Soon),
        (Heading, &[TrackerAttitude], ResetDelay::Never),
        (Heading, &[GnssVelocity], ResetDelay::Never),
        (Heading, &[TrackerPosition], ResetDelay::Late),
        (Height, &[TrackerPosition, GnssHeight, GnssVelocity], ResetDelay::Soon),
    ] {
        assert_eq!(trust(aid, live, 1050), expected, "{aid:?}, {live:?}");
        let alone = if aid == Heading { ResetDelay::Late } else { ResetDelay::Soon };
        assert_eq!(trust(aid, live, 1051), alone, "{aid:?}, {live:?}");
    }
}

#[test]
fn an_aid_is_live_for_a_while() {
    let mut record = AidRecord::default();
    assert!(!record.is_live(1000, u64::MAX));
    assert_eq!((record.reject(500), record.reject(900), record.rejected), (0, 400, 2));
    record.accept(1000);
    assert_eq!((record.accepted, record.accepted_us, record.rejected_since_us), (1, Some(1000), None));
    assert!(record.is_live(1100, 100) && !record.is_live(1101, 100) && record.is_live(500, 0));
    assert_eq!(record.reject(2000), 0);
    // Each aid holds the position, the velocity or neither.
    for live in AidSource::ALL {
        let mut aids = AidRecords::default();
        aids.of_mut(live).accept(1000);
        for aid in AidSource::ALL {
            assert_eq!(aids.of(aid).accepted == 1, aid == live, "{live:?}, {aid:?}");
        }
        let position = matches!(live, AidSource::TrackerPosition | AidSource::GnssPosition);
        assert_eq!(aids.holds_position(1050, 50), position);
        assert_eq!(aids.holds_velocity(1050, 50), position || live == AidSource::GnssVelocity);
        assert!(!aids.holds_velocity(1051, 50) && !aids.holds_position(1051, 50));
    }
    let passes = |x, y, z| passes(&Vector3::new(x, y, z), &Vector3::new(1.0, 4.0, 9.0), 25.0);
    assert!(
        passes(5.0, -10.0, 15.0) && !passes(5.01, 0.0, 0.0) && !passes(0.0, -10.02, 0.0) && !passes(0.0, 0.0, 15.03)
    );
    assert!(!passes(f32::NAN, 0.0, 0.0));
    // A pose counts as repeated from its first arrival, and only if every bit is equal.
    let mut repeated = FrozenPoseDetector::default();
    let (place, turn) = (Vector3::new(1.0, 2.0, 3.0), [1.0, 0.0, 0.0, 0.0]);
    assert_eq!(repeated.lasts_us(&place, &turn, 1000), 0);
    repeated.doubted = true;
    assert_eq!((repeated.lasts_us(&place, &turn, 1700), repeated.doubted), (700, true));
    assert_eq!((repeated.lasts_us(&place, &[1.0, 1e-7, 0.0, 0.0], 1800), repeated.doubted), (0, false));
    assert_eq!(repeated.lasts_us(&(place * 1.000_001), &turn, 1900), 0);
}

#[test]
fn rough_samples_count_for_a_while() {
    let mut memory = Memory::default();
    assert_eq!(memory.roughened_since(0), (0.0, 0.0));
    memory.inflate_variances(1_000_000, 0.5, 2.0);
    memory.inflate_variances(1_300_000, 0.25, 1.0);
    assert_eq!((memory.rough, memory.roughened_since(1_299_999)), ((0.75, 3.0), (0.75, 3.0)));
    assert_eq!(memory.roughened_since(1_300_000), (0.0, 0.0));
    // The earlier sum is older than any measurement and no longer counts.
    memory.inflate_variances(1_600_001, 0.125, 0.5);
    assert_eq!((memory.rough, memory.roughened_since(1_600_000)), ((0.875, 3.5), (0.125, 0.5)));
    // An implausible measurement is counted, and a ninth one pushes out the first.
    for heading_rad in [f32::NAN, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0] {
        memory.offer(&Stamped { value: Measurement::Heading { heading_rad, sigma_rad: 0.1 }, at_us: 5 });
    }
    assert_eq!((memory.dropped().implausible, memory.dropped().crowded, memory.queue.waiting()), (1, 1, 8));
    // The vehicle stands if it is told so, or if unknown, until it moves.
    assert!(!memory.stands());
    memory.rest = crate::rest::RestDetector::aligned(Vector3::zeros(), Vector3::z());
    assert!(memory.stands());
    memory.rest.unmoved = false;
    assert!(!memory.stands());
    memory.set_on_ground(true);
    assert!(memory.stands());
    memory.set_on_ground(false);
    assert!(!memory.stands());
}

/// Every plausibility limit is tested in every coordinate and with both signs.
#[test]
fn the_door_has_bounds() {
    let one = |k: usize, x: f32| Vector3::from_fn(|i, _| if i == k { x } else { 0.0 });
    let pose = |position_m, attitude, position_sigma_m, attitude_sigma_rad| Measurement::Pose {
        position_m,
        attitude,
        position_sigma_m,
        attitude_sigma_rad,
    };
    let gnss = |position_m, velocity_m_s, sigmas: [f32; 4]| {
        let [horizontal_sigma_m, vertical_sigma_m, speed_sigma_m_s, climb_sigma_m_s] = sigmas;
        Measurement::Gnss {
            position_m,
            velocity_m_s,
            horizontal_sigma_m,
            vertical_sigma_m,
            speed_sigma_m_s,
            climb_sigma_m_s,
        }
    };
    let (zero, level, sigmas) = (Vector3::zeros(), [1.0, 0.0, 0.0, 0.0], [1.0; 4]);
    let check = |what: &str, most: f32, of: &dyn Fn(f32) -> bool| {
        assert!(of(0.999 * most), "{what}: {most} is refused");
        assert!(!of(1.001 * most) && !of(f32::NAN) && !of(f32::INFINITY), "{what}: beyond {most} is accepted");
    };
    for k in 0..3 {
        for sign in [1.0, -1.0] {
            check("position", 5e4, &|x| pose(one(k, sign * x), level, 0.1, 0.1).is_plausible());
            check("place", 5e4, &|x| {
                Measurement::Position { position_m: one(k, sign * x), sigma_m: 0.1 }.is_plausible()
            });
            check("fix", 5e4, &|x| gnss(one(k, sign * x), zero, sigmas).is_plausible());
            check("speed", 150.0, &|x| gnss(zero, one(k, sign * x), sigmas).is_plausible());
            check("field", 1e7, &|x| Measurement::MagneticField { field: one(k, sign * x), sigma: 1.0 }.is_plausible());
            check("rate", 200.0, &|x| {
                ImuSample { at_us: 0, rates_rad_s: one(k, sign * x), specific_force_m_s2: zero }.is_plausible()
            });
            check("force", 2000.0, &|x| {
                ImuSample { at_us: 0, rates_rad_s: zero, specific_force_m_s2: one(k, sign * x) }.is_plausible()
            });
            check("height", 5e4, &|x| Measurement::Height { height_m: sign * x, sigma_m: 1.0 }.is_plausible());
            check("heading", 1e3, &|x| Measurement::Heading { heading_rad: sign * x, sigma_rad: 1.0 }.is_plausible());
        }
    }
    for k in 0..4 {
        let mut sigmas = sigmas;
        check("sigma", 1e4, &|x| {
            let mut sigmas = sigmas;
            sigmas[k] = x;
            gnss(zero, zero, sigmas).is_plausible()
        });
        sigmas[k] = 0.0;
        assert!(!gnss(zero, zero, sigmas).is_plausible());
        sigmas[k] = -1.0;
        assert!(!gnss(zero, zero, sigmas).is_plausible());
    }
    for k in 0..4 {
        let turned = |square: f32| {
            let mut q = [0.0; 4];
            q[k] = -square.sqrt();
            pose(zero, q, 0.1, 0.1).is_plausible()
        };
        assert!(turned(0.91) && turned(1.09) && !turned(0.89) && !turned(1.11) && !turned(f32::NAN), "{k}");
    }
    for (sigma, good) in [(0.0, false), (-1.0, false), (1e-9, true), (9.9e3, true), (1.1e4, false), (f32::NAN, false)] {
        assert_eq!(pose(zero, level, sigma, 0.1).is_plausible(), good, "{sigma}");
        assert_eq!(pose(zero, level, 0.1, sigma).is_plausible(), good, "{sigma}");
        assert_eq!(Measurement::Position { position_m: zero, sigma_m: sigma }.is_plausible(), good, "{sigma}");
        assert_eq!(Measurement::Height { height_m: 0.0, sigma_m: sigma }.is_plausible(), good, "{sigma}");
        assert_eq!(Measurement::Heading { heading_rad: 0.0, sigma_rad: sigma }.is_plausible(), good, "{sigma}");
        let in_any_unit = good || sigma == 1.1e4;
        assert_eq!(Measurement::MagneticField { field: Vector3::z(), sigma }.is_plausible(), in_any_unit, "{sigma}");
    }
    assert!(!Measurement::MagneticField { field: Vector3::z(), sigma: 1.1e7 }.is_plausible());
    let faint = |x: f32| Measurement::MagneticField { field: Vector3::repeat(-x), sigma: 1.0 }.is_plausible();
    assert!(faint(1.1e-7) && !faint(0.9e-7));
    // An origin is accepted within limits of latitude, longitude and altitude.
    let is = |latitude, longitude, altitude| GeodeticOrigin::new(latitude, longitude, altitude).is_some();
    assert!(is(88.9, 179.9, 1.9e4) && is(-88.9, -179.9, -1.9e4));
    assert!(!is(89.1, 0.0, 0.0) && !is(-89.1, 0.0, 0.0) && !is(0.0, 180.1, 0.0) && !is(0.0, -180.1, 0.0));
    assert!(!is(0.0, 0.0, 2.1e4) && !is(0.0, 0.0, -2.1e4) && !is(f64::NAN, 0.0, 0.0));
    // The identity is the identity.
    assert!((Rotation3::from_matrix_unchecked(matrix(&identity())).angle()).abs() < 1e-6);
}

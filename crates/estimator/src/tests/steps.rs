//! Checks the limits within a step, each just within and just beyond: refusal, following, rest, rough samples,
//! validity.

use super::memory;
use super::{M21, V3, V21, covariance, dense, dense_row, difference, numbers, row, vector};
use crate::aid::AidSource;
use crate::errors::VectorComponent;
use crate::estimate::{Resets, Validity};
use crate::estimator::Estimator;
use crate::horizon::{ExpectedReadings, FusionHorizon, ObservedQuantity};
use crate::measurement::{ImuSample, Measurement};
use crate::memory::Memory;
use crate::queue::parts;
use crate::rest::RestDetector;
use crate::settings::Settings;
use afbc_types::Stamped;
use nalgebra::{Matrix3, Quaternion, Vector3};
use proptest::prelude::*;

const NOW_US: u64 = 1_000_000;

fn with(settings: Settings) -> Estimator {
    Estimator::new(settings).unwrap()
}

/// Returns a covariance with these variances: rotation, velocity, position, biases, offset.
fn diagonal(variances: [f64; 6]) -> M21 {
    dense(&super::blocks(&M21::from_diagonal(&V21::from_fn(|i, _| if i < 16 { variances[i / 3] } else { 0.0 }))))
}

fn usual() -> M21 {
    diagonal([1e-4, 1e-2, 1e-2, 1e-6, 1e-4, 1e-2])
}

/// Queues a measurement of time `at_us` and fuses until the queue is empty, at `now_us`.
fn offer(estimator: &Estimator, memory: &mut Memory, value: Measurement, at_us: u64, now_us: u64) {
    memory.offer(&Stamped { value, at_us });
    memory.still_us = now_us;
    for _ in 0..16 {
        estimator.fuse(memory, now_us);
    }
}

/// Stores the present state at a later time.
fn later(memory: &mut Memory, at_us: u64) {
    memory.store_history(at_us);
}

fn place(position_m: Vector3<f32>) -> Measurement {
    Measurement::Position { position_m, sigma_m: 0.1 }
}

proptest! {
    /// `motion_variance` is the sum of the variances of position and velocity, each with its squared factor.
    #[test]
    fn a_motions_variance_is_that_of_place_and_speed(p in covariance(), row in row()) {
        let (at, h) = (VectorComponent::ALL.iter().position(|c| *c == row.coordinate).unwrap(), dense_row(&row));
        let theirs = h[6 + at] * h[6 + at] * p[(6 + at, 6 + at)] + h[3 + at] * h[3 + at] * p[(3 + at, 3 + at)];
        let ours = f64::from(super::blocks(&p).motion_variance(&row));
        prop_assert!((ours - theirs).abs() < 1e-5 * (theirs + 1e-9));
    }

    /// A field corrects only heading and gyroscope bias, with the right covariance for this gain.
    #[test]
    fn a_field_turns_and_does_not_tilt(
        p in covariance(), turn in numbers::<3>(), by in -0.1..0.1_f64, declination in -1.0..1.0_f64,
        steep in 0.1..0.9_f64,
    ) {
        let own = 0.05_f64;
        let settings = Settings { declination_rad: declination as f32, mag_slow_rad: own as f32, ..Settings::DEFAULT };
        let scale = V21::from_fn(|i, _| match i {
            0..3 => 0.05,
            16..19 => 0.0,
            19.. => own / p[(i, i)].sqrt(),
            _ => 1.0,
        });
        let p = M21::from_diagonal(&scale) * p * M21::from_diagonal(&scale);
        let p = dense(&super::blocks(&p));
        let mut memory = memory(&p, &(vector(turn) * 0.3));
        let level = (1.0 - steep * steep).sqrt();
        memory.field = Some((0.5, -steep as f32));
        // Field in the estimated attitude with the heading off by an angle.
        let north = -declination - by;
        let earth = V3::new(level * north.cos(), level * north.sin(), -steep) * 0.5;
        let field = memory.nominal.rotation.map(f64::from).tr_mul(&earth).map(|x| x as f32);
        let before = memory;
        let past = memory.history.newest().unwrap();
        let expected = V3::new(level * declination.cos(), -level * declination.sin(), -steep).map(|x| x as f32);
        let horizon = FusionHorizon::new(&past, &past, 9.81);
        let expected = ExpectedReadings { height_offset: 0.0, field: expected };
        let of = horizon.row(&ObservedQuantity::Field(field), VectorComponent::X, &expected);
        let h = dense_row(&of.unwrap().1);
        offer(&with(settings), &mut memory, Measurement::MagneticField { field, sigma: 0.01 }, NOW_US, NOW_US);
        prop_assert_eq!((memory.aids().heading.accepted, memory.dropped().disturbed), (1, 0));
        let variance = 1e-4 / (0.25 * level * level) + 1e-6;
        let s = h.dot(&(p * h)) + variance;
        let k = p * h / s;
        let k = V21::from_fn(|i, _| if i == 2 || (9..12).contains(&i) { k[i] } else { 0.0 });
        let i = M21::identity() - k * h.transpose();
        let theirs = i * p * i.transpose() + k * k.transpose() * variance;
        let ours = dense(&memory.covariance);
        let sub = |m: &M21| M21::from_fn(|i, j| match (i, j) {
            (0..16, 0..16) => m[(i, j)],
            _ if i == j => 1.0,
            _ => 0.0,
        });
        prop_assert!(difference(&sub(&ours), &sub(&theirs)) < 2e-3, "{}", difference(&sub(&ours), &sub(&theirs)));
        let turned = crate::rotation::difference(&memory.nominal.attitude, &before.nominal.attitude).map(f64::from);
        prop_assert!((turned - V3::z() * (k[2] * by)).norm() < 1e-4 + 0.01 * by.abs(), "{turned}");
        let bias = (memory.nominal.gyro_bias - before.nominal.gyro_bias).map(f64::from);
        prop_assert!((bias - V3::new(k[9], k[10], k[11]) * by).norm() < 0.01 * 0.003 + 1e-6);
        let (now, then) = (&memory.nominal, &before.nominal);
        prop_assert!(now.velocity == then.velocity && now.position == then.position);
        prop_assert_eq!(now.accel_bias, then.accel_bias);
        let nis = by * by / s;
        prop_assert!((f64::from(memory.aids().heading.nis) - nis).abs() < 0.02 * nis + 1e-4);
    }
}

/// A field of another strength or inclination is dropped.
#[test]
fn a_disturbed_field_is_not_looked_at() {
    let settings = Settings { field_error_max: 0.2, inclination_error_max_rad: 0.1, ..Settings::DEFAULT };
    for steep in [-0.9_f32, 0.3, -0.99] {
        let slope = 0.1 * (1.0 - steep * steep).sqrt().max(0.2);
        for (strength, lift, fused) in [
            (1.19, 0.0, true),
            (1.21, 0.0, false),
            (0.81, 0.0, true),
            (0.79, 0.0, false),
            (1.0, 0.98 * slope, true),
            (1.0, 1.02 * slope, false),
            (1.0, -1.02 * slope, false),
            (1.0, -0.98 * slope, true),
        ] {
            let mut memory = memory(&usual(), &V3::zeros());
            memory.field = Some((2.0, steep));
            let z = (steep + lift).clamp(-1.0, 1.0);
            if (steep + lift).abs() > 1.0 {
                continue;
            }
            let field = Vector3::new((1.0 - z * z).sqrt(), 0.0, z) * (2.0 * strength);
            offer(&with(settings), &mut memory, Measurement::MagneticField { field, sigma: 0.05 }, NOW_US, NOW_US);
            // A field within ten degrees of vertical gives no heading.
            let upright = 1.0 - steep * steep < 0.03;
            let accepted = memory.aids().heading.accepted;
            assert_eq!(memory.dropped().disturbed, u32::from(!fused), "{steep}, {strength}, {lift}");
            assert_eq!(accepted, u32::from(fused && !upright), "{steep}, {strength}, {lift}");
        }
    }
    // The first field becomes the reference, unless the vehicle's own field may be as large.
    for (slow, heard) in [(0.49, true), (0.51, false)] {
        let mut memory = memory(&usual(), &V3::zeros());
        let value = Measurement::MagneticField { field: Vector3::new(3.0, 0.0, -4.0), sigma: 0.01 };
        offer(&with(Settings { mag_slow_rad: slow, ..settings }), &mut memory, value, NOW_US, NOW_US);
        assert_eq!(memory.field, heard.then_some((5.0, -0.8)));
        assert_eq!(memory.dropped().disturbed, u32::from(!heard));
    }
}

/// A measurement that was rejected for long enough, and that no other aid contradicts, is followed. A second reset
/// within ten seconds raises the tilt variance.
#[test]
fn what_is_rejected_for_long_is_believed() {
    let estimator = with(Settings { reacquire_s: 1.0, frozen_s: 0.0, ..Settings::DEFAULT });
    let far = Vector3::new(10.0, 0.0, 0.0);
    let gnss = |position_m, velocity_m_s| Measurement::Gnss {
        position_m,
        velocity_m_s,
        horizontal_sigma_m: 0.1,
        vertical_sigma_m: 0.1,
        speed_sigma_m_s: 0.1,
        climb_sigma_m_s: 0.1,
    };
    let heading = |heading_rad| Measurement::Heading { heading_rad, sigma_rad: 0.01 };
    let height = |memory: &Memory, by: f32| Measurement::Height {
        height_m: memory.nominal.position.z + memory.height_offset + by,
        sigma_m: 0.1,
    };
    type Told = fn(&Resets) -> u32;
    let start = memory(&usual(), &V3::zeros());
    let (here, speed) = (start.nominal.position, start.nominal.velocity);
    let cases: [(Measurement, Told, AidSource, Option<AidSource>); 5] = [
        (place(here + far), |r| r.position, AidSource::TrackerPosition, Some(AidSource::GnssPosition)),
        (gnss(here + far, speed), |r| r.position, AidSource::GnssPosition, Some(AidSource::TrackerPosition)),
        (gnss(here, speed + far), |r| r.velocity, AidSource::GnssVelocity, Some(AidSource::TrackerPosition)),
        (heading(1.0), |r| r.heading, AidSource::Heading, Some(AidSource::TrackerAttitude)),
        (height(&start, 10.0), |r| r.height, AidSource::Height, None),
    ];
    for (value, told, aid, other) in cases {
        for (lasts_us, contradicted, believed) in
            [(999_000, false, false), (1_000_000, false, true), (1_000_000, true, false)]
        {
            let mut memory = start;
            offer(&estimator, &mut memory, value, NOW_US, NOW_US);
            assert_eq!((memory.aids().of(aid).rejected, told(&memory.resets)), (1, 0), "{aid:?}");
            if let Some(other) = other.filter(|_| contradicted) {
                memory.aids.of_mut(other).accept(NOW_US + lasts_us - 1_000_000);
            } else if contradicted {
                continue;
            }
            later(&mut memory, NOW_US + lasts_us);
            offer(&estimator, &mut memory, value, NOW_US + lasts_us, NOW_US + lasts_us);
            assert_eq!(told(&memory.resets), u32::from(believed), "{aid:?}, {lasts_us}, {contradicted}");
            assert_eq!(memory.aids().of(aid).accepted, u32::from(believed), "{aid:?}, {lasts_us}");
            let n = &memory.nominal;
            match (aid, believed) {
                (AidSource::TrackerPosition | AidSource::GnssPosition, _) => {
                    let off = (n.position - here - if believed { far } else { Vector3::zeros() }).norm();
                    assert!(off < 1e-3, "{aid:?}: {off}");
                    // Only a tracker's jump raises the velocity variance, because no velocity was fused with it.
                    let doubted = memory.covariance.vv.m11 > 50.0;
                    assert_eq!(doubted, believed && aid == AidSource::TrackerPosition);
                }
                (AidSource::GnssVelocity, true) => assert!((n.velocity - speed - far).norm() < 1e-3),
                (AidSource::Heading, true) => assert!((crate::rotation::euler(&n.attitude).z - 1.0).abs() < 1e-4),
                (AidSource::Height, true) => assert!((memory.height_offset - start.height_offset - 10.0).abs() < 1e-3),
                _ => {}
            }
        }
    }
    // A second reset.
    for (after_us, doubts) in [(9_999_000, 1), (10_000_000, 0)] {
        let mut memory = start;
        memory.reset_us = Some(NOW_US + 1_000_000 - after_us.min(NOW_US + 1_000_000));
        let last_us = memory.reset_us.unwrap();
        let now_us = last_us + after_us;
        later(&mut memory, now_us);
        memory.aids.tracker_position.rejected_since_us = Some(now_us - 1_000_000);
        offer(&estimator, &mut memory, place(here + far), now_us, now_us);
        assert_eq!((memory.resets.position, memory.resets.tilt), (1, doubts), "{after_us}");
        assert_eq!(memory.reset_us, Some(now_us));
    }
}

/// The first measurement sets an unknown part of the state, with the measurement's variance.
#[test]
fn the_first_measurement_sets_what_it_tells() {
    let estimator = with(Settings { declination_rad: 0.3, ..Settings::DEFAULT });
    let mut memory = memory(&usual(), &V3::zeros());
    memory.knows = crate::memory::KnownStates::default();
    let here = Vector3::new(100.0, -50.0, 20.0);
    offer(&estimator, &mut memory, place(here), NOW_US, NOW_US);
    assert!((memory.nominal.position - here).norm() < 1e-4 && memory.knows.position);
    assert!((memory.covariance.pp.m11 - 0.01).abs() < 1e-6);
    offer(&estimator, &mut memory, Measurement::Height { height_m: 520.0, sigma_m: 0.2 }, NOW_US, NOW_US);
    assert!((memory.height_offset - 500.0).abs() < 1e-3 && memory.knows.height_offset);
    assert!((memory.covariance.bb - 0.05).abs() < 1e-5);
    for (value, yaw, variance) in [
        (Measurement::Heading { heading_rad: 2.0, sigma_rad: 0.1 }, 2.0, 0.01),
        // True north is west of the field by the declination. The field's slope is 3 to 4, so the tilt error counts
        // with 9/16.
        (
            Measurement::MagneticField { field: Vector3::new(4.0, 0.0, -3.0), sigma: 0.4 },
            -0.3,
            0.16 / 16.0 + 1e-6 + 1e-4 * 9.0 / 16.0 + 0.04,
        ),
        (
            Measurement::Pose {
                position_m: here,
                attitude: [0.5_f32.cos(), 0.0, 0.0, 0.5_f32.sin()],
                position_sigma_m: 1.0,
                attitude_sigma_rad: 0.1,
            },
            1.0,
            0.01 + 1e-4,
        ),
    ] {
        let mut memory = memory;
        memory.knows.heading = false;
        offer(&estimator, &mut memory, value, NOW_US, NOW_US);
        let found = crate::rotation::euler(&memory.nominal.attitude).z;
        assert!((found - yaw).abs() < 1e-4 && memory.knows.heading, "{value:?}: {found}");
        let found = memory.covariance.tt.m33;
        assert!((found - variance).abs() < 0.01 * variance, "{value:?}: {found}, not {variance}");
    }
}

#[test]
fn late_and_early_ones_are_dropped() {
    let estimator = with(Settings::DEFAULT);
    let fresh = || {
        let mut memory = memory(&usual(), &V3::zeros());
        memory.nominal.velocity = Vector3::zeros();
        memory.history.clear();
        for back in (0..=71).rev() {
            memory.store_history(NOW_US - back * 4000);
        }
        memory
    };
    for (at_us, late, accepted) in [(NOW_US - 270_000, 0, 1), (NOW_US - 270_001, 1, 0), (NOW_US - 284_001, 1, 0)] {
        let mut memory = fresh();
        let value = place(memory.nominal.position);
        offer(&estimator, &mut memory, value, at_us, NOW_US);
        assert_eq!((memory.dropped().late, memory.aids().tracker_position.accepted), (late, accepted), "{at_us}");
    }
    for (at_us, early, waits) in [(NOW_US + 20_000, 0, 1), (NOW_US + 20_001, 1, 0)] {
        let mut memory = fresh();
        let value = place(memory.nominal.position);
        offer(&estimator, &mut memory, value, at_us, NOW_US);
        assert_eq!((memory.dropped().early, memory.queue.waiting()), (early, waits), "{at_us}");
    }
    // A measurement of the same time is dropped as overtaken; one a microsecond later is not.
    for (after_us, overtaken) in [(0, 1), (1, 0)] {
        let mut memory = fresh();
        let value = place(memory.nominal.position + Vector3::repeat(0.01));
        offer(&estimator, &mut memory, value, NOW_US - 5000, NOW_US);
        offer(&estimator, &mut memory, value, NOW_US - 5000 + after_us, NOW_US);
        assert_eq!(memory.dropped().overtaken, overtaken);
        assert_eq!(memory.aids().tracker_position.accepted, 2 - overtaken);
    }
}

/// Zero velocity is fused every 0.2 s if the vehicle stands and is slow, or if no aid holds the velocity.
#[test]
fn rest_is_a_measurement() {
    let estimator = with(Settings { coast_s: 5.0, ..Settings::DEFAULT });
    let slow = Vector3::new(0.02, -0.01, 0.03);
    let still = || {
        let mut memory = memory(&diagonal([1e-6, 1e-4, 1e-2, 1e-8, 1e-6, 1e-2]), &V3::zeros());
        memory.rest = RestDetector::aligned(Vector3::zeros(), Vector3::z() * 9.81);
        memory.nominal.velocity = slow;
        memory.store_history(NOW_US);
        memory.aids.gnss_position.accept(NOW_US);
        memory
    };
    let run = |memory: &mut Memory| (0..8).for_each(|_| estimator.fuse(memory, NOW_US));
    for (since_us, due) in [(199_999, false), (200_000, true)] {
        let mut memory = still();
        memory.still_us = NOW_US - since_us;
        run(&mut memory);
        assert_eq!(memory.held_us, due.then_some(NOW_US));
        // The velocity's variance of 1e-4 is a 26th of the innovation's variance of 26e-4.
        let kept = if due { 25.0 / 26.0 } else { 1.0 };
        assert!((memory.nominal.velocity - slow * kept).norm() < 1e-4, "{}", memory.nominal.velocity);
    }
    // The limit is three standard deviations of 0.051 m/s.
    for (speed, held) in [(0.150, true), (0.156, false)] {
        for k in 0..3 {
            let mut memory = still();
            memory.nominal.velocity = Vector3::from_fn(|i, _| if i == k { -speed } else { 0.0 });
            memory.store_history(NOW_US);
            memory.still_us = 0;
            run(&mut memory);
            assert_eq!(memory.held_us.is_some(), held, "{k}, {speed}");
            assert!(held || memory.nominal.velocity[k] == -speed);
        }
    }
    // In the air, five seconds without an aid start a weak measurement of zero velocity, with a standard deviation of
    // 25 m/s.
    for (aided_us, weak) in [(5_000_000, false), (5_000_001, true)] {
        let mut memory = memory(&diagonal([1e-6, 625.0, 1e-2, 1e-8, 1e-6, 1e-2]), &V3::zeros());
        memory.nominal.velocity = Vector3::new(4.0, 0.0, 0.0);
        let now_us = 10_000_000;
        memory.store_history(now_us);
        memory.aids.tracker_position.accept(now_us - aided_us);
        for _ in 0..8 {
            estimator.fuse(&mut memory, now_us);
        }
        let expected = if weak { 2.0 } else { 4.0 };
        assert!((memory.nominal.velocity.x - expected).abs() < 0.01, "{}", memory.nominal.velocity.x);
        assert_eq!(memory.held_us, None);
    }
}

/// Each limit of validity is tested in every coordinate.
#[test]
fn validity_has_limits() {
    let s = Settings::DEFAULT;
    let estimator = with(s);
    let now_us = 20_000_000;
    let sample = ImuSample { at_us: now_us, rates_rad_s: Vector3::zeros(), specific_force_m_s2: Vector3::z() * 9.81 };
    let valid = |change: &dyn Fn(&mut Memory)| {
        let mut memory = memory(&usual(), &V3::zeros());
        let _ = memory.monitor.take(&sample, &s);
        memory.store_history(now_us);
        memory.still_us = now_us;
        memory.aids.gnss_position.accept(now_us);
        memory.aids.height.accept(now_us);
        change(&mut memory);
        estimator.step(&mut memory, now_us, None).validity
    };
    let all = Validity { attitude: true, heading: true, velocity: true, position: true, height: true };
    assert_eq!(valid(&|_| ()), all);
    let set = |m: &mut Matrix3<f32>, k: usize, sigma: f32| m[(k, k)] = sigma * sigma;
    for (share, is) in [(0.99, true), (1.01, false)] {
        for k in 0..2 {
            assert_eq!(valid(&|m| set(&mut m.covariance.tt, k, share * s.tilt_sigma_max_rad)).attitude, is);
        }
        let v = valid(&|m| set(&mut m.covariance.tt, 2, share * s.heading_sigma_max_rad));
        assert_eq!((v.attitude, v.heading, v.position), (true, is, true));
        for k in 0..3 {
            let v = valid(&|m| set(&mut m.covariance.vv, k, share * s.velocity_sigma_max_m_s));
            // A barometer keeps the height valid until the vertical velocity is too uncertain.
            assert_eq!((v.velocity, v.position, v.height), (is, is, is || k < 2), "{k}");
            let v = valid(&|m| set(&mut m.covariance.pp, k, share * s.position_sigma_max_m));
            assert_eq!((v.velocity, v.position, v.height), (true, is, is || k < 2), "{k}");
        }
    }
    let v = valid(&|m| m.knows.heading = false);
    assert_eq!(v, Validity { heading: false, ..all });
    assert_eq!(valid(&|m| m.knows.position = false), Validity { position: false, ..all });
    let coast_us = (s.coast_s * 1e6) as u64;
    for (since_us, is) in [(coast_us, true), (coast_us + 1, false)] {
        let v = valid(&|m| m.aids.gnss_position.accept(now_us - since_us));
        assert_eq!(v, Validity { velocity: is, position: is, ..all });
        let v = valid(&|m| {
            m.aids.gnss_position.accept(0);
            m.aids.gnss_velocity.accept(now_us - since_us);
        });
        assert_eq!(v, Validity { velocity: is, position: false, ..all });
        let v = valid(&|m| {
            m.aids.gnss_position.accept(0);
            m.held_us = Some(now_us - since_us);
        });
        assert_eq!(v, Validity { velocity: is, position: false, ..all });
        let v = valid(&|m| {
            m.aids.gnss_position.accept(0);
            m.aids.height.accept(now_us - since_us);
        });
        assert_eq!(v, Validity { velocity: false, position: false, height: is, ..all });
    }
    // `at_rest` lasts for half a second after the last zero-velocity fusion.
    for (since_us, is) in [(499_999, true), (500_000, false)] {
        let mut memory = memory(&usual(), &V3::zeros());
        let _ = memory.monitor.take(&sample, &s);
        memory.rest = RestDetector::aligned(Vector3::zeros(), Vector3::z() * 9.81);
        (memory.held_us, memory.still_us) = (Some(now_us - since_us), now_us);
        memory.store_history(now_us);
        assert_eq!(estimator.step(&mut memory, now_us, None).at_rest, is);
    }
}

/// A clipped sample or a gap raises the variances by the motion that is possible meanwhile.
#[test]
fn rough_samples_leave_it_less_sure() {
    let s = Settings::DEFAULT;
    let estimator = with(s);
    let run = |gap_us: u64, rate: f32, push: f32| {
        let mut memory = memory(&usual(), &V3::zeros());
        let sample = |at_us, rate, push| ImuSample {
            at_us,
            rates_rad_s: Vector3::new(0.0, 0.0, rate),
            specific_force_m_s2: Vector3::new(0.0, push, 9.81),
        };
        let _ = memory.monitor.take(&sample(NOW_US, 0.0, 0.0), &s);
        memory.nominal.begin(&sample(NOW_US, 0.0, 0.0));
        let at_us = NOW_US + gap_us;
        let _ = estimator.step(&mut memory, at_us, Some(&sample(at_us, rate, push)));
        (memory.covariance.tt.m33 - 1e-4, memory.covariance.vv.m33 - 1e-2, memory.resets.restarts)
    };
    let near = |ours: f32, theirs: f32| (ours - theirs).abs() < 0.05 * theirs + 2e-6;
    // Little comes from the prediction's own noise.
    let (theta, velocity, _) = run(20_000, 0.0, 0.0);
    assert!(theta < 1e-6 && velocity < 1e-3, "{theta}, {velocity}");
    let (theta, velocity, _) = run(100_000, 0.0, 0.0);
    assert!(near(theta, 0.0025) && near(velocity, 0.09), "{theta}, {velocity}");
    // A clipped sensor raises only the variance of what it measures.
    let (theta, velocity, _) = run(4000, 0.985 * s.gyro_range_rad_s, 0.0);
    assert!(near(theta, 0.08) && velocity < 1e-3, "{theta}, {velocity}");
    let (theta, velocity, _) = run(4000, 0.0, 0.985 * s.accel_range_m_s2);
    assert!(theta < 1e-6 && near(velocity, 0.8), "{theta}, {velocity}");
    assert_eq!((run(249_000, 0.0, 0.0).2, run(250_000, 0.0, 0.0).2), (0, 1));
}

/// The variance of each scalar is at least the minimum. Rough samples add their part.
#[test]
fn each_part_has_its_variance() {
    let zero = Vector3::zeros();
    let all = |sigma: f32| {
        [
            (parts(&Measurement::Position { position_m: zero, sigma_m: sigma }), 1e-4_f32),
            (parts(&Measurement::Height { height_m: 0.0, sigma_m: sigma }), 1e-4),
            (parts(&Measurement::Heading { heading_rad: 0.0, sigma_rad: sigma }), 1e-4),
        ]
    };
    for sigma in [1e-6_f32, 0.5] {
        for (parts, least) in all(sigma) {
            let part = parts[0].unwrap();
            assert!((part.variance.x - sigma.max(least).powi(2)).abs() < 1e-9 && parts[1].is_none());
        }
    }
    let fix = |speed_sigma_m_s, climb_sigma_m_s| {
        parts(&Measurement::Gnss {
            position_m: zero,
            velocity_m_s: zero,
            horizontal_sigma_m: 2.0,
            vertical_sigma_m: 3.0,
            speed_sigma_m_s,
            climb_sigma_m_s,
        })
    };
    let [.., Some(velocity)] = fix(0.5, 1.5) else { panic!("no velocity") };
    assert_eq!(velocity.variance, Vector3::new(0.25, 0.25, 2.25));
    let [Some(position), Some(height), Some(velocity)] = fix(1e-5, 1e-5) else { panic!("a part is missing") };
    assert!((position.variance - Vector3::new(4.0, 4.0, 9.0)).norm() < 1e-5);
    assert!((velocity.variance - Vector3::repeat(1e-6)).norm() < 1e-9);
    let aids = [position, height, velocity].map(|part| part.aid.unwrap());
    assert_eq!(aids, [AidSource::GnssPosition, AidSource::GnssHeight, AidSource::GnssVelocity]);
    assert!(position.is_slow() && height.is_slow() && !velocity.is_slow() && height.variance == position.variance);
    assert_eq!([position, height, velocity].map(|part| part.scalars()), [2, 1, 3]);
    for (target, more) in [
        (ObservedQuantity::Position(zero), 0.5 * 0.04),
        (ObservedQuantity::Height(0.0), 0.5 * 0.04),
        (ObservedQuantity::Velocity(zero), 0.5),
        (ObservedQuantity::Attitude(Quaternion::new(1.0, 0.0, 0.0, 0.0)), 0.3),
        (ObservedQuantity::Heading(0.0), 0.3),
        (ObservedQuantity::Field(Vector3::x()), 0.0),
    ] {
        let mut part = crate::queue::AidObservation { target, ..position };
        part.inflate_variances((0.3, 0.5), 0.2);
        assert!((part.variance - position.variance - Vector3::repeat(more)).norm() < 1e-6, "{target:?}");
        assert_eq!(part.rough, 0.3);
        part = crate::queue::AidObservation { target, ..position };
        part.inflate_variances((0.0, 0.0), 0.2);
        assert!(part.variance == position.variance && part.rough == 0.0);
    }
}

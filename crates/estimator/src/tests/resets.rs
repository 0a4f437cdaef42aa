//! Checks starts and resets against dense mathematics in `f64`: each is a linear map of the errors plus noise.

extern crate std;

use super::{M21, V3, blocks, covariance, dense, dense_row, difference, memory, numbers, vector};
use crate::align::{Alignment, AlignmentResult, Unready};
use crate::errors::{SlowErrors, VectorComponent};
use crate::estimate::Sigmas;
use crate::estimator::Estimator;
use crate::history::PastState;
use crate::horizon::{FusionHorizon, ObservedQuantity, magnetic};
use crate::measurement::{ImuSample, Measurement};
use crate::memory::Memory;
use crate::queue::{AidObservation, FusedAxes};
use crate::restart::reference;
use crate::settings::Settings;
use afbc_types::State;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use proptest::prelude::*;
use std::vec::Vec;

fn part(aid: crate::AidSource, target: ObservedQuantity, axes: FusedAxes, variance: &V3) -> AidObservation {
    AidObservation { aid: Some(aid), target, axes, variance: variance.map(|x| x as f32), rough: 0.0 }
}

fn three(m: &mut M21, i: usize, j: usize, block: &Matrix3<f64>) {
    m.fixed_view_mut::<3, 3>(i, j).copy_from(block);
}

/// Returns the horizon of a vehicle that has moved straight on for `tau_s`.
fn since(memory: &mut Memory, tau_s: f32) -> FusionHorizon {
    let now = memory.history.newest().unwrap();
    let at_us = now.at_us - (tau_s * 1e6) as u32;
    let past = PastState { at_us, position: now.position - now.velocity * tau_s, ..now };
    FusionHorizon::new(&now, &past, 9.81)
}

proptest! {
    #[test]
    fn a_new_position_is_the_measurements(
        p in covariance(), by in numbers::<3>(), noise in numbers::<3>(), tau in 0.0..0.25_f64, which in 0..4_usize,
    ) {
        let estimator = Estimator::new(Settings::DEFAULT).unwrap();
        let mut memory = memory(&p, &V3::new(0.1, -0.2, 0.7));
        let variance = vector(noise).map(|x| x * x + 0.01);
        let (aid, axes, coordinates) = [
            (crate::AidSource::TrackerPosition, FusedAxes::All, 0..3),
            (crate::AidSource::GnssPosition, FusedAxes::All, 0..3),
            (crate::AidSource::GnssPosition, FusedAxes::Level, 0..2),
            (crate::AidSource::GnssHeight, FusedAxes::Vertical, 2..3),
        ][which].clone();
        let horizon = since(&mut memory, tau as f32);
        let by = vector(by).map(|x| x as f32) * 10.0;
        let before = memory.nominal.position;
        let part = part(aid, ObservedQuantity::Position(horizon.past().position + by), axes, &variance);
        let rows: Vec<_> = VectorComponent::ALL.into_iter().map(|at| {
            dense_row(&horizon.row(&part.target, at, &estimator.expected(&memory)).unwrap().1)
        }).collect();
        estimator.follow(&mut memory, &part, &horizon);
        let by = Vector3::from_fn(|i, _| if coordinates.contains(&i) { by[i] } else { 0.0 });
        prop_assert!((memory.nominal.position - before - by).norm() < 1e-5);
        prop_assert!((memory.history.newest().unwrap().position - before - by).norm() < 1e-5);
        prop_assert!(memory.resets.position == 1 && memory.knows.position);
        prop_assert_eq!(memory.knows.height_offset, axes == FusedAxes::Level);
        // Linear map of the errors for the replaced coordinates.
        let mut t = M21::identity();
        for i in coordinates.clone() {
            let mut row = -rows[i];
            row[6 + i] = 0.0;
            if aid != crate::AidSource::TrackerPosition {
                row[16 + i] = -1.0;
            }
            t.set_row(6 + i, &row.transpose());
        }
        if axes != FusedAxes::Level {
            t.fixed_rows_mut::<1>(15).fill(0.0);
        }
        let mut theirs = t * p * t.transpose();
        coordinates.for_each(|i| theirs[(6 + i, 6 + i)] += variance[i]);
        if axes != FusedAxes::Level {
            // The offset is forgotten, so its variance is the smallest one.
            theirs[(15, 15)] = 1e-8;
        }
        let ours = dense(&memory.covariance);
        prop_assert!(difference(&ours, &theirs) < 1e-4, "{}", difference(&ours, &theirs));
    }

    #[test]
    fn a_new_velocity_or_height_is_the_measurements(
        p in covariance(), by in numbers::<3>(), noise in numbers::<3>(), offset in -50.0..50.0_f32,
    ) {
        let estimator = Estimator::new(Settings::DEFAULT).unwrap();
        let variance = vector(noise).map(|x| x * x + 0.01);
        let by = vector(by).map(|x| x as f32) * 10.0;
        let mut fast = memory(&p, &V3::new(0.1, -0.2, 0.7));
        let before = fast.nominal.velocity;
        let horizon = since(&mut fast, 0.0);
        estimator.follow(
            &mut fast,
            &part(crate::AidSource::GnssVelocity, ObservedQuantity::Velocity(before + by), FusedAxes::All, &variance),
            &horizon,
        );
        prop_assert!((fast.nominal.velocity - before - by).norm() < 1e-5 && fast.resets.velocity == 1);
        prop_assert!((fast.history.newest().unwrap().velocity - before - by).norm() < 1e-5);
        let mut t = M21::identity();
        three(&mut t, 3, 3, &Matrix3::zeros());
        let mut theirs = t * p * t.transpose();
        (0..3).for_each(|i| theirs[(3 + i, 3 + i)] += variance[i]);
        prop_assert!(difference(&dense(&fast.covariance), &theirs) < 1e-5);
        // `doubt_velocity` adds to the variance and leaves the velocity.
        let mut doubted = memory(&p, &V3::zeros());
        doubted.doubt_velocity(&variance.map(|x| x as f32));
        let mut theirs = p;
        (0..3).for_each(|i| theirs[(3 + i, 3 + i)] += variance[i]);
        prop_assert!(difference(&dense(&doubted.covariance), &theirs) < 1e-6);
        prop_assert_eq!(doubted.nominal.velocity, before);
        // The offset's error is the negative height error plus noise.
        let mut high = memory(&p, &V3::zeros());
        high.knows.height_offset = false;
        let horizon = since(&mut high, 0.0);
        let height = horizon.past().position.z + offset;
        let height_part = part(crate::AidSource::Height, ObservedQuantity::Height(height), FusedAxes::All, &variance);
        estimator.follow(&mut high, &height_part, &horizon);
        prop_assert!((high.height_offset - offset).abs() < 1e-5 && high.knows.height_offset);
        prop_assert!(high.resets.height == 1);
        let mut t = M21::identity();
        t.fixed_rows_mut::<1>(15).fill(0.0);
        t[(15, 8)] = -1.0;
        let mut theirs = t * p * t.transpose();
        theirs[(15, 15)] += variance.x;
        prop_assert!(difference(&dense(&high.covariance), &theirs) < 1e-5);
    }

    #[test]
    fn a_new_heading_turns_everything(
        p in covariance(), turn in numbers::<3>(), by in -3.0..3.0_f64, sigma in 0.01..0.5_f64,
        declination in -3.0..3.0_f32, which in 0..3_usize,
    ) {
        let estimator = Estimator::new(Settings { declination_rad: declination, ..Settings::DEFAULT }).unwrap();
        let mut memory = memory(&p, &(vector(turn) * 0.5));
        memory.knows.heading = false;
        memory.field = Some((1.0, -0.6));
        let (old, entry) = (memory.nominal.rotation, memory.history.newest().unwrap());
        let horizon = since(&mut memory, 0.0);
        let r = UnitQuaternion::new(V3::z() * by);
        // Measurements that show this turn.
        let field = r.inverse() * estimator.expected(&memory).field.map(f64::from);
        let q = (r.into_inner() * Quaternion::from(entry.attitude.coords.map(f64::from))).coords.map(|x| x as f32);
        let target = match which {
            0 => ObservedQuantity::Field(old.tr_mul(&field.map(|x| x as f32))),
            1 => ObservedQuantity::Attitude(Quaternion::from(q)),
            _ => ObservedQuantity::Heading(horizon.heading() + by as f32),
        };
        let part = part(crate::AidSource::Heading, target, FusedAxes::All, &V3::repeat(sigma * sigma));
        estimator.follow(&mut memory, &part, &horizon);
        let r = r.to_rotation_matrix().into_inner();
        let turned = r.map(|x| x as f32) * old;
        prop_assert!((memory.nominal.rotation - turned).norm() < 1e-4 && (memory.rotation - turned).norm() < 1e-4);
        let now = memory.history.newest().unwrap();
        let along = crate::rotation::yaw_between(&now.attitude, &entry.attitude);
        prop_assert!((f64::from(along) - by).abs() < 1e-4 && memory.knows.heading && memory.resets.heading == 1);
        // After the turn, the heading error follows from the other errors by the measurement's row.
        let horizon = FusionHorizon::new(&now, &now, 9.81);
        let row = horizon.row(&part.target, VectorComponent::Z, &estimator.expected(&memory));
        let mut row = -dense_row(&row.unwrap().1);
        row[2] = 0.0;
        let mut first = M21::identity();
        three(&mut first, 0, 0, &r);
        let mut second = M21::identity();
        second.set_row(2, &row.transpose());
        let turned = first * p * first.transpose();
        let mut theirs = second * turned * second.transpose();
        theirs[(2, 2)] += match which {
            0 => f64::from(crate::fusion::field_variance(&field.map(|x| x as f32), (sigma * sigma) as f32)),
            1 => sigma * sigma + p[(0, 0)].max(p[(1, 1)]),
            _ => sigma * sigma,
        };
        let ours = dense(&memory.covariance);
        prop_assert!(difference(&ours, &theirs) < 1e-3, "{}", difference(&ours, &theirs));
        // The variance of the gyroscope bias grows about the vertical and hardly about other axes.
        let before = dense(&memory.covariance);
        memory.inflate_vertical_gyro_bias();
        let more = dense(&memory.covariance) - before;
        let body = memory.nominal.rotation.transpose().map(f64::from);
        let up = body * V3::z() * 0.02;
        let gg = more.fixed_view::<3, 3>(9, 9).into_owned();
        prop_assert!((gg - up * up.transpose() - Matrix3::identity() * 4e-6).norm() < 1e-6, "{gg}");
        prop_assert!((more.norm() - gg.norm()).abs() < 1e-9);
    }

    #[test]
    fn a_doubted_tilt_is_less_sure(p in covariance()) {
        let mut memory = memory(&p, &V3::zeros());
        memory.inflate_tilt();
        let mut theirs = p;
        for (i, sigma) in [(0, 0.2), (1, 0.2), (9, 0.02), (10, 0.02), (11, 0.02), (12, 0.2), (13, 0.2), (14, 0.2)] {
            theirs[(i, i)] += sigma * sigma;
        }
        prop_assert!(difference(&dense(&memory.covariance), &theirs) < 1e-6 && memory.resets.tilt == 1);
    }

    /// The covariance with a slow error keeps its share at the next fix, and shrinks with a smaller variance.
    #[test]
    fn a_slow_error_keeps_its_share(p in covariance(), to in numbers::<3>(), share in 0.0..1.0_f64) {
        let variance = vector(to).map(|x| x * x * 4.0 + 1e-3);
        let mut ours = blocks(&p);
        ours.slow.follow(&variance.map(|x| x as f32), share as f32);
        let mut theirs = p;
        for i in 0..3 {
            let (old, new) = (p[(16 + i, 16 + i)], variance[i]);
            let kept = share * (new / old).min(1.0);
            for j in 0..16 {
                theirs[(16 + i, j)] *= kept;
                theirs[(j, 16 + i)] *= kept;
            }
            theirs[(16 + i, 16 + i)] = new;
        }
        prop_assert!(difference(&dense(&ours), &theirs) < 1e-6);
    }

    /// After a start at rest with a wrong accelerometer, level, north and their covariances follow from the biases.
    #[test]
    fn a_start_at_rest_knows_its_errors(
        tilt in numbers::<2>(), yaw in -3.1..3.1_f64, axis in 0..3_usize, declination in -0.5..0.5_f64,
        teller in 0..3_u8,
    ) {
        let bias = 0.05;
        let settings = Settings {
            accel_bias_m_s2: bias as f32, declination_rad: declination as f32, mag_slow_rad: 0.1,
            accel_noise_m_s2_rthz: 1e-4, gyro_noise_rad_s_rthz: 1e-3, gyro_walk_rad_s_rts: 1e-3, ..Settings::DEFAULT
        };
        let leans = UnitQuaternion::new(V3::new(0.5 * tilt[0], 0.5 * tilt[1], 0.0));
        let truth = UnitQuaternion::new(V3::z() * yaw) * leans;
        // True north is west of the field by the declination, which is positive to the east.
        let field = UnitQuaternion::new(-V3::z() * declination) * V3::new(0.45, 0.0, -0.9);
        let error = V3::from_fn(|i, _| if i == axis { bias } else { 0.0 });
        let gyro = Vector3::new(0.01_f32, -0.02, 0.03);
        let aligned = aligned(&truth, &error, &field, &gyro, teller, &settings);
        prop_assert!(aligned.is_some());
        let aligned = aligned.unwrap();
        prop_assert!((aligned.gyro_bias - gyro).norm() < 1e-5 && (aligned.time_s - 1.0).abs() < 1e-3);
        let estimator = Estimator::new(settings).unwrap();
        let mut memory = Memory::default();
        memory.begin(5_000_000, &aligned, &estimator);
        prop_assert!(memory.runs && memory.knows.heading && !memory.knows.position);
        prop_assert_eq!(memory.covariance_us, 5_000_000);
        prop_assert!(memory.rest.is_still() && memory.rest.unmoved && memory.still_us == 5_000_000);
        let c = &memory.covariance;
        let ours = UnitQuaternion::from_quaternion(Quaternion::from(memory.nominal.attitude.coords.map(f64::from)));
        let off = (truth * ours.inverse()).scaled_axis();
        let told = c.ta.column(axis).map(f64::from) / bias;
        let off = if teller == 0 { off } else { V3::new(off.x, off.y, 0.0) };
        let told = if teller == 0 { told } else { V3::new(told.x, told.y, 0.0) };
        prop_assert!((off - told).norm() < 0.1 * off.norm() + 2e-4, "{off}, not {told}");
        if teller > 0 {
            prop_assert!(c.ta.row(2).norm() < 1e-9, "nobody turns by the tilt: {}", c.ta);
        }
        // The tilt has the variance of bias and noise. The heading has the variance of the sensor that gave it.
        let g2 = 9.81_f64 * 9.81;
        let level = f64::from(c.tt.m11.max(c.tt.m22));
        prop_assert!((level - bias * bias / g2).abs() < 0.1 * bias * bias / g2 + 2e-7, "{level}");
        let heading = f64::from(c.tt.m33) - c.ta.row(2).map(f64::from).norm_squared() / (bias * bias);
        let of_field = 1e-4 / 0.45_f64.powi(2) / 100.0;
        let (noise, iron) = match teller { 0 => (of_field, 0.01), 1 => (4e-4, 0.0), _ => (9e-4, 0.0) };
        let off = heading - noise - iron * level_share(&memory, declination);
        prop_assert!(off.abs() < 0.06 * (noise + iron), "{heading}");
        prop_assert!((f64::from(c.gg.m11) - 2e-6).abs() < 1e-7 && (f64::from(c.aa.m22) - bias * bias).abs() < 1e-7);
        prop_assert!((c.vv.m11 - 4e-6).abs() < 1e-8 && (c.pp.m33 - 1e-4).abs() < 1e-6);
        prop_assert_eq!(memory.field.is_some(), teller == 0);
        if let Some((strength, steep)) = memory.field {
            prop_assert!((f64::from(strength) - field.norm()).abs() < 1e-2);
            prop_assert!((f64::from(steep) - field.z / field.norm()).abs() < 1e-2);
        }
    }
}

/// Returns the share of the vehicle's own field variance that turns the heading, which is 1 on level ground.
fn level_share(memory: &Memory, declination: f64) -> f64 {
    let north = Vector3::new(declination.cos() as f32, -declination.sin() as f32, 0.0);
    f64::from(magnetic(&memory.nominal.rotation, &north).norm_squared())
}

/// Aligns a vehicle at rest in the attitude `truth`, with the heading from a field (0), a tracker (1) or a heading.
fn aligned(
    truth: &UnitQuaternion<f64>,
    error: &V3,
    field: &V3,
    gyro: &Vector3<f32>,
    teller: u8,
    settings: &Settings,
) -> Option<AlignmentResult> {
    let body = |v: V3| truth.inverse_transform_vector(&v).map(|x| x as f32);
    let yaw = truth.euler_angles().2 as f32;
    let mut align = Alignment::default();
    for ms in 0..=100_u64 {
        let q = truth.into_inner();
        align.add_heading(&match teller {
            0 => Measurement::MagneticField { field: body(*field), sigma: 0.01 },
            1 => Measurement::Pose {
                position_m: Vector3::zeros(),
                attitude: [q.w, q.i, q.j, q.k].map(|x| x as f32),
                position_sigma_m: 0.1,
                attitude_sigma_rad: 0.02,
            },
            _ => Measurement::Heading { heading_rad: yaw, sigma_rad: 0.03 },
        });
        let sample = ImuSample {
            at_us: 1_000_000 + ms * 10_000,
            rates_rad_s: *gyro,
            specific_force_m_s2: body(V3::z() * 9.81) + error.map(|x| x as f32),
        };
        let result = align.advance(&sample, settings);
        assert_eq!(result.is_some(), ms == 100);
        if result.is_some() {
            return result;
        }
    }
    None
}

/// A start in the air takes the given state and standard deviations within their limits, and knows the rest as unknown.
#[test]
fn a_start_in_the_air_is_as_told() {
    let mut memory = Memory::default();
    let state = State {
        position_m: Vector3::new(1.0, 2.0, 3.0),
        velocity_m_s: Vector3::new(-1.0, 0.5, 0.2),
        attitude_rad: Vector3::new(0.1, -0.2, 2.0),
        ..State::default()
    };
    let sigmas = |heading: f32, place: f32| Sigmas {
        attitude_rad: Vector3::new(0.1, 0.2, heading),
        velocity_m_s: Vector3::new(0.3, 0.4, 0.5),
        position_m: Vector3::new(0.6, place, 0.8),
        gyro_bias_rad_s: Vector3::new(0.01, 0.02, 0.03),
        accel_bias_m_s2: Vector3::new(0.4, 0.5, 0.6),
        height_offset_m: 0.0,
    };
    memory.begin_at(2_000_000, &state, &sigmas(0.9, 999.0));
    let variances = memory.covariance.variances();
    let square = |v: Vector3<f32>| v.component_mul(&v);
    let told = sigmas(0.9, 999.0);
    assert!((variances.theta - square(told.attitude_rad)).norm() < 1e-6);
    assert!((variances.velocity - square(told.velocity_m_s)).norm() < 1e-6);
    assert!((variances.position - square(told.position_m)).norm() < 0.1);
    assert!((variances.gyro - square(told.gyro_bias_rad_s)).norm() < 1e-8);
    assert!((variances.accel - square(told.accel_bias_m_s2)).norm() < 1e-6);
    assert!(
        (memory.nominal.position - state.position_m).norm() < 1e-6 && memory.nominal.velocity == state.velocity_m_s
    );
    assert!(memory.knows.heading && memory.knows.position && !memory.knows.height_offset && memory.runs);
    assert!(!memory.stands());
    memory.begin_at(2_000_000, &state, &sigmas(1.1, 1001.0));
    assert!(!memory.knows.heading && !memory.knows.position);
    memory.begin_at(2_000_000, &state, &sigmas(500.0, 1.0));
    assert!(memory.covariance.variances().theta.z <= 3.3);
    // A restart keeps the present state, or the last valid one.
    memory.restart(3_000_000);
    assert!((memory.nominal.position - state.position_m).norm() < 1e-6 && memory.resets.restarts == 1);
    let variances = memory.covariance.variances();
    assert!((variances.theta.x - 0.1).abs() < 1e-6 && variances.theta.z > 3.0 && variances.velocity.y == 25.0);
    assert!(variances.position.z == 100.0 && !memory.knows.position && !memory.knows.heading);
    let attitude = memory.nominal.attitude;
    (memory.nominal.position.x, memory.nominal.velocity.y) = (f32::NAN, 51.0);
    (memory.nominal.gyro_bias.z, memory.nominal.accel_bias.x) = (1.1, f32::INFINITY);
    memory.nominal.attitude = Quaternion::new(f32::NAN, 0.0, 0.0, 0.0);
    memory.restart(4_000_000);
    let n = &memory.nominal;
    assert!(n.position.norm() + n.velocity.norm() + n.gyro_bias.norm() + n.accel_bias.norm() == 0.0, "{n:?}");
    assert!((n.attitude - attitude).norm() < 1e-5, "{n:?}");
    let far = Vector3::new(4.9e4, 0.0, -4.9e4);
    memory.nominal.move_to(far);
    (memory.nominal.velocity, memory.nominal.gyro_bias) = (Vector3::repeat(-49.0), Vector3::repeat(0.9));
    memory.nominal.accel_bias = Vector3::repeat(-4.9);
    memory.restart(5_000_000);
    let n = &memory.nominal;
    assert!(n.position == far && n.velocity.x == -49.0 && n.gyro_bias.y == 0.9 && n.accel_bias.z == -4.9, "{n:?}");
    assert_eq!(reference(&Vector3::new(0.0, 3.0, -4.0)), Some((5.0, -0.8)));
    assert_eq!(reference(&Vector3::zeros()), None);
    assert_eq!(memory.covariance.slow.variance, SlowErrors::zeros());
}

/// Each limit of the alignment is tested just within and just beyond.
#[test]
fn an_alignment_has_limits() {
    let settings = Settings::DEFAULT;
    // Returns the refusal within the first second, `None` if the alignment succeeded.
    let runs = |change: &dyn Fn(u64, &mut ImuSample)| {
        let mut align = Alignment::default();
        for ms in 0..=1000_u64 {
            let mut sample = ImuSample {
                at_us: 1_000_000 + 1000 * ms,
                rates_rad_s: Vector3::zeros(),
                specific_force_m_s2: Vector3::new(0.0, 0.0, 9.81),
            };
            change(ms, &mut sample);
            if align.advance(&sample, &settings).is_some() {
                return None;
            }
        }
        Some(align.why)
    };
    let (rate, force) = (settings.still_rate_rad_s, settings.still_accel_m_s2);
    let shake = |ms: u64, size: f32| if ms.is_multiple_of(2) { size } else { -size };
    for (k, sign) in [(0, 1.0_f32), (1, -1.0), (2, 1.0)] {
        let moving = Some(Unready::Moving);
        for (share, why) in [(0.9, None), (1.1, moving)] {
            // A large spread, one outlier or a slow change makes the vehicle count as moving.
            assert_eq!(runs(&|ms, s| s.rates_rad_s[k] += shake(ms, share * rate)), why, "{k}, {share}");
            assert_eq!(runs(&|ms, s| s.specific_force_m_s2[k] += shake(ms, share * force)), why, "{k}, {share}");
            let late = |ms: u64| if ms == 900 { 6.0 * share * sign } else { 0.0 };
            assert_eq!(runs(&|ms, s| s.rates_rad_s[k] += late(ms) * rate), why, "{k}, {share}");
            assert_eq!(runs(&|ms, s| s.specific_force_m_s2[k] += late(ms) * force), why, "{k}, {share}");
            // The mean of the whole differs from the first half's mean.
            let step = |ms: u64| if ms > 500 { 0.5 * share * sign } else { 0.0 };
            assert_eq!(runs(&|ms, s| s.rates_rad_s[k] += step(ms) * rate), why, "{k}, {share}");
            if k < 2 {
                assert_eq!(runs(&|ms, s| s.specific_force_m_s2[k] += step(ms) * force), why, "{k}, {share}");
            }
            let turning = why.map(|_| Unready::Turning);
            assert_eq!(runs(&|_, s| s.rates_rad_s[k] += sign * share * settings.gyro_bias_max_rad_s), turning, "{k}");
        }
    }
    let heavy = 2.0 * force + settings.accel_bias_m_s2;
    for (share, why) in [(0.95, None), (1.05, Some(Unready::NotGravity))] {
        assert_eq!(runs(&|_, s| s.specific_force_m_s2.z += share * heavy), why);
        assert_eq!(runs(&|_, s| s.specific_force_m_s2.z -= share * heavy), why);
    }
    for (share, why) in [(0.98, None), (1.02, Some(Unready::Tilted))] {
        let (sine, cosine) = (share * settings.align_tilt_rad).sin_cos();
        assert_eq!(runs(&|_, s| s.specific_force_m_s2 = Vector3::new(9.81 * sine, 0.0, 9.81 * cosine)), why);
        assert_eq!(runs(&|_, s| s.specific_force_m_s2 = Vector3::new(0.0, -9.81 * sine, 9.81 * cosine)), why);
    }
}

/// The variance of a mean is a sample's variance divided by their number.
#[test]
fn a_mean_is_as_good_as_its_samples() {
    let mut align = Alignment::default();
    let mut found = None;
    for ms in 0..=1000_u64 {
        let sign = if ms.is_multiple_of(2) { 1.0 } else { -1.0 };
        let sample = ImuSample {
            at_us: 1_000_000 + 1000 * ms,
            rates_rad_s: Vector3::new(0.0, 0.01 * sign, 0.0),
            specific_force_m_s2: Vector3::new(0.2 * sign, 0.0, 9.81),
        };
        found = align.advance(&sample, &Settings::DEFAULT);
    }
    let found = found.unwrap();
    let near = |ours: f32, theirs: f32| (ours / theirs - 1.0).abs() < 0.01;
    assert!(near(found.rates_variance, 1e-7) && near(found.force_variance, 4e-5), "{found:?}");
}

//! Checks covariance and Jacobians against independent dense mathematics in `f64`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)] // tests

extern crate std;

mod fused;
mod parts;
mod resets;
mod steps;

use crate::covariance::{Covariance, ProcessNoise};
use crate::errors::{ErrorVector, JacobianRow, PredictionInterval, ReplacedError, SlowErrors, VectorComponent};
use crate::estimator::Estimator;
use crate::history::{PastState, StateHistory};
use crate::horizon::{ExpectedReadings, FusionHorizon, ObservedQuantity};
use crate::memory::Memory;
use crate::queue::{AidObservation, FusedAxes};
use crate::settings::Settings;
use crate::slow::SlowErrorCovariances;
use nalgebra::{Matrix3, Quaternion, Rotation3, SMatrix, SVector, UnitQuaternion, Vector3};
use proptest::prelude::*;
use std::vec::Vec;

/// Returns a memory with this covariance and attitude.
fn memory(p: &M21, turn: &V3) -> Memory {
    let mut memory = Memory { runs: true, covariance: blocks(p), ..Memory::default() };
    let q = UnitQuaternion::new(*turn).into_inner().coords.map(|x| x as f32);
    memory.nominal.turn_to(Quaternion::from(q));
    (memory.nominal.velocity, memory.nominal.position) = (Vector3::new(1.0, -2.0, 0.5), Vector3::new(3.0, 4.0, 5.0));
    memory.rotation = memory.nominal.rotation;
    memory.knows.position = true;
    memory.knows.heading = true;
    memory.knows.height_offset = true;
    memory.store_history(1_000_000);
    memory
}

/// The filter's 16 errors and the 5 slow errors of receiver and magnetometer.
type M21 = SMatrix<f64, 21, 21>;
type V21 = SVector<f64, 21>;
type V3 = Vector3<f64>;

/// Typical sizes of the errors with three coordinates.
const SIZES: [f64; 5] = [0.02, 0.3, 0.5, 0.003, 0.08];

fn size(i: usize) -> f64 {
    match i {
        0..15 => SIZES[i / 3],
        15 => 0.4,
        16..19 => 1.2,
        _ => 0.05,
    }
}

/// Converts a dense matrix to blocks.
fn blocks(p: &M21) -> Covariance {
    let block = |i: usize, j: usize| p.fixed_view::<3, 3>(3 * i, 3 * j).map(|x| x as f32).into_owned();
    let slow = |i: usize| p.fixed_view::<3, 5>(3 * i, 16).map(|x| x as f32).into_owned();
    let column = |i: usize| p.fixed_view::<3, 1>(3 * i, 15).map(|x| x as f32).into_owned();
    Covariance {
        tt: block(0, 0),
        tv: block(0, 1),
        tp: block(0, 2),
        tg: block(0, 3),
        ta: block(0, 4),
        vv: block(1, 1),
        vp: block(1, 2),
        vg: block(1, 3),
        va: block(1, 4),
        pp: block(2, 2),
        pg: block(2, 3),
        pa: block(2, 4),
        gg: block(3, 3),
        ga: block(3, 4),
        aa: block(4, 4),
        tb: column(0),
        vb: column(1),
        pb: column(2),
        gb: column(3),
        ab: column(4),
        bb: p[(15, 15)] as f32,
        slow: SlowErrorCovariances {
            variance: SlowErrors::from_fn(|i, _| p[(16 + i, 16 + i)] as f32),
            theta: slow(0),
            velocity: slow(1),
            position: slow(2),
            gyro: slow(3),
            accel: slow(4),
            baro: SlowErrors::from_fn(|i, _| p[(15, 16 + i)] as f32),
        },
    }
}

fn dense(p: &Covariance) -> M21 {
    let rows = p.rows();
    let slow = [&p.slow.theta, &p.slow.velocity, &p.slow.position, &p.slow.gyro, &p.slow.accel];
    let with_slow = |i: usize, j: usize| match i {
        0..15 => slow[i / 3][(i % 3, j)],
        15 => p.slow.baro[j],
        _ if i == 16 + j => p.slow.variance[j],
        _ => 0.0,
    };
    M21::from_fn(|i, j| {
        let (i, j) = (i.min(j), i.max(j));
        f64::from(if j < 16 { rows[i][j] } else { with_slow(i, j - 16) })
    })
}

fn dense_errors(e: &ErrorVector) -> V21 {
    let parts = [e.theta, e.velocity, e.position, e.gyro, e.accel];
    V21::from_fn(|i, _| {
        f64::from(match i {
            0..15 => parts[i / 3][i % 3],
            15 => e.baro,
            _ => e.slow[i - 16],
        })
    })
}

fn dense_row(row: &JacobianRow) -> V21 {
    let none = Vector3::zeros();
    let at = row.coordinate.unit();
    dense_errors(&ErrorVector {
        theta: row.theta,
        velocity: at * row.velocity,
        position: at * row.position,
        gyro: row.gyro.unwrap_or(none),
        accel: row.accel.unwrap_or(none),
        baro: row.baro,
        slow: row.slow.unwrap_or_default(),
    })
}

/// Returns the largest difference of an element, relative to the product of both standard deviations.
fn difference(ours: &M21, theirs: &M21) -> f64 {
    let of = |i, j| (ours[(i, j)] - theirs[(i, j)]).abs() / (theirs[(i, i)] * theirs[(j, j)]).sqrt();
    (0..21).flat_map(|i| (0..21).map(move |j| (i, j))).map(|(i, j)| of(i, j)).fold(0.0, f64::max)
}

fn numbers<const N: usize>() -> impl Strategy<Value = [f64; N]> {
    proptest::array::uniform(-1.0..1.0_f64)
}

/// Draws a positive covariance with errors of typical sizes, rounded to what the filter can store.
fn covariance() -> impl Strategy<Value = M21> {
    proptest::collection::vec(-1.0..1.0_f64, 21 * 21).prop_map(|x| {
        // The slow errors are independent of each other.
        let mut a = M21::from_iterator(x) + M21::identity();
        a.fixed_rows_mut::<5>(16).fill(0.0);
        (16..21).for_each(|i| a[(i, i)] = 1.5);
        let b = a * a.transpose() / 6.0;
        let floor = V21::from_fn(|i, _| if i < 16 { 0.03 } else { 0.0 });
        let p = M21::from_fn(|i, j| size(i) * size(j) * (b[(i, j)] + if i == j { floor[i] } else { 0.0 }));
        dense(&blocks(&p))
    })
}

fn vector([x, y, z]: [f64; 3]) -> V3 {
    V3::new(x, y, z)
}

fn row() -> impl Strategy<Value = JacobianRow> {
    let slow = numbers::<5>();
    (numbers::<3>(), numbers::<3>(), numbers::<3>(), numbers::<3>(), slow, 0..3_usize, any::<[bool; 6]>()).prop_map(
        |(theta, gyro, accel, [v, p, b], slow, coordinate, on)| {
            let single = |x: [f64; 3]| vector(x).map(|x| x as f32);
            let number = |x: f64, on: bool| if on { x as f32 } else { 0.0 };
            JacobianRow {
                coordinate: VectorComponent::ALL[coordinate],
                theta: single(theta),
                velocity: number(v, on[0]),
                position: number(p, on[1]),
                gyro: on[2].then(|| single(gyro)),
                accel: on[3].then(|| single(accel)),
                baro: number(b, on[4]),
                slow: on[5].then(|| SlowErrors::from_fn(|i, _| slow[i] as f32)),
            }
        },
    )
}

/// Returns the transition matrix as a dense matrix.
fn transition(interval: &PredictionInterval) -> M21 {
    let mut f = M21::identity();
    let t = f64::from(interval.time_s);
    let c = interval.turn.map(f64::from);
    let s = interval.thrust.map(f64::from).cross_matrix();
    f.fixed_view_mut::<3, 3>(0, 9).copy_from(&-c);
    f.fixed_view_mut::<3, 3>(3, 0).copy_from(&-s);
    f.fixed_view_mut::<3, 3>(3, 12).copy_from(&-c);
    f.fixed_view_mut::<3, 3>(6, 3).copy_from(&(Matrix3::identity() * t));
    f
}

const GROWTH: ProcessNoise = ProcessNoise { theta: 1e-6, velocity: 4e-4, gyro: 1e-9, accel: 1e-7, baro: 4e-4 };

proptest! {
    /// `of_motion` is the upper left corner of the whole matrix.
    #[test]
    fn the_motions_part_is_the_corner_of_the_whole(p in covariance()) {
        let ours = blocks(&p);
        let whole = ours.rows();
        for (part, row) in ours.of_motion().iter().zip(&whole) {
            prop_assert_eq!(&part[..], &row[..9]);
        }
    }

    #[test]
    fn prediction_is_f_p_f_plus_q(
        p in covariance(), turn in numbers::<3>(), thrust in numbers::<3>(), t in 1e-3..0.02_f64,
    ) {
        let rotation: Matrix3<f64> = Rotation3::new(vector(turn) * 3.0).into_inner();
        let interval = PredictionInterval {
            time_s: t as f32,
            turn: rotation.map(|x| (x * t) as f32),
            thrust: (vector(thrust) * 30.0 * t).map(|x| x as f32),
        };
        let f = transition(&interval);
        let growth = [GROWTH.theta, GROWTH.velocity, 0.0, GROWTH.gyro, GROWTH.accel, GROWTH.baro];
        let q = M21::from_diagonal(&V21::from_fn(|i, _| if i < 16 { f64::from(growth[i / 3]) * t } else { 0.0 }));
        let mut ours = blocks(&p);
        ours.predict(&interval, &GROWTH);
        let theirs = f * p * f.transpose() + q;
        prop_assert!(difference(&dense(&ours), &theirs) < 2e-6, "{}", difference(&dense(&ours), &theirs));
    }

    #[test]
    fn update_is_josephs(p in covariance(), row in row(), variance in 1e-4..1.0_f64, any_gain in numbers::<16>()) {
        let h = dense_row(&row);
        prop_assume!(h.norm() > 0.1);
        let s = h.dot(&(p * h)) + variance;
        let ours = blocks(&p);
        let y = ours.times(&row);
        let scale = V21::from_fn(|i, _| p[(i, i)].sqrt());
        let off = (dense_errors(&y) - p * h).component_div(&scale).norm();
        prop_assert!(off < 1e-5 * s.sqrt(), "P h: {off}");
        prop_assert!((f64::from(row.dot(&y)) + variance - s).abs() < 1e-5 * s, "h P h");
        let joseph = |k: &V21| {
            let i = M21::identity() - k * h.transpose();
            i * p * i.transpose() + k * k.transpose() * variance
        };
        // The optimal gain.
        let mut optimal = ours;
        optimal.fuse(&y, s as f32);
        let considered = |k: V21| V21::from_fn(|i, _| if i < 16 { k[i] } else { 0.0 });
        let theirs = joseph(&considered(p * h / s));
        prop_assert!(difference(&dense(&optimal), &theirs) < 1e-4, "{}", difference(&dense(&optimal), &theirs));
        // Any other gain.
        let k = V21::from_fn(|i, _| if i < 16 { any_gain[i] * size(i) / s.sqrt() } else { 0.0 });
        let part = |i: usize| k.fixed_rows::<3>(3 * i).map(|x| x as f32).into_owned();
        let gain = ErrorVector {
            theta: part(0), velocity: part(1), position: part(2), gyro: part(3), accel: part(4), baro: k[15] as f32,
            slow: SlowErrors::zeros(),
        };
        let mut other = ours;
        other.fuse_with(&gain, &y, s as f32);
        let theirs = joseph(&k);
        prop_assert!(difference(&dense(&other), &theirs) < 1e-5, "{}", difference(&dense(&other), &theirs));
        let ours = dense(&other);
        prop_assert_eq!(ours, ours.transpose());
    }

    /// The matrix stays positive when a receiver's stated accuracy changes.
    #[test]
    fn another_slow_error_leaves_it_positive(p in covariance(), to in numbers::<3>(), share in 0.0..1.0_f64) {
        let variance = vector(to).map(|x| (x * x * 4.0 + 1e-3) as f32);
        let mut ours = blocks(&p);
        ours.slow.follow(&variance, share as f32);
        let theirs = dense(&ours);
        prop_assert_eq!(theirs.fixed_view::<16, 16>(0, 0), p.fixed_view::<16, 16>(0, 0));
        let sigma = V21::from_fn(|i, _| theirs[(i, i)].sqrt());
        let correlation = M21::from_fn(|i, j| theirs[(i, j)] / (sigma[i] * sigma[j]));
        prop_assert!(correlation.symmetric_eigenvalues().min() > -1e-6);
    }

    /// A heading that was reset to a field has the error of the vehicle's own field. So the next field agrees with it
    /// and corrects no other error.
    #[test]
    fn a_field_agrees_with_its_heading(p in covariance(), turn in numbers::<3>(), by in -3.0..3.0_f64) {
        let mut memory = memory(&p, &(vector(turn) * 0.3));
        memory.field = Some((1.0, -0.6));
        let settings = Settings { declination_rad: 0.4, ..Settings::DEFAULT };
        let estimator = Estimator::new(settings).unwrap();
        let field = Rotation3::new(V3::z() * by) * V3::new(0.7, 0.3, -0.6);
        let body = memory.nominal.rotation.tr_mul(&field.map(|x| x as f32));
        let part = AidObservation {
            aid: Some(crate::AidSource::Heading), target: ObservedQuantity::Field(body), axes: FusedAxes::All,
            variance: Vector3::repeat(1e-6), rough: 0.0,
        };
        let now = memory.history.newest().unwrap();
        estimator.follow(&mut memory, &part, &FusionHorizon::new(&now, &now, 9.81));
        let now = memory.history.newest().unwrap();
        let horizon = FusionHorizon::new(&now, &now, 9.81);
        let seen = horizon.row(&part.target, VectorComponent::Z, &estimator.expected(&memory));
        let (innovation, row) = seen.unwrap();
        prop_assert!(innovation.abs() < 1e-4, "{innovation}");
        let y = memory.covariance.times(&row);
        // The innovation contains only the noise and shows nothing about other errors.
        let noise = f64::from(crate::fusion::field_variance(&field.map(|x| x as f32), 1e-6));
        prop_assert!((f64::from(row.dot(&y)) - noise).abs() < 1e-5, "{}", row.dot(&y));
        prop_assert!(f64::from(y.velocity.norm() + y.position.norm() + y.gyro.norm() + y.accel.norm()) < 1e-4, "{y:?}");
    }

    /// A replaced error is a linear map of the other errors plus noise, so the matrix stays a covariance for any row.
    #[test]
    fn a_replaced_error_is_the_measurements(
        p in covariance(), h in numbers::<21>(), which in 0..8_usize, sigma in 0.01..0.5_f64,
    ) {
        let at = VectorComponent::ALL[which % 3];
        let (index, replaced) = match which {
            0..3 => (6 + which, ReplacedError::Position(at)),
            3..6 => (which, ReplacedError::Velocity(at)),
            6 => (2, ReplacedError::Heading),
            _ => (15, ReplacedError::Offset),
        };
        let at = if which < 6 { at } else { VectorComponent::Z };
        let three = |i: usize| Vector3::from_fn(|c, _| (h[3 * i + c] * size(index) / size(3 * i)) as f32);
        let mut row = JacobianRow {
            coordinate: at, theta: three(0), velocity: three(1).x, position: three(2).y, gyro: Some(three(3)),
            accel: Some(three(4)), baro: h[15] as f32, slow: Some(SlowErrors::from_fn(|i, _| h[16 + i] as f32)),
        };
        match replaced {
            ReplacedError::Heading => row.theta.z = 0.0,
            ReplacedError::Velocity(_) => row.velocity = 0.0,
            ReplacedError::Position(_) => row.position = 0.0,
            ReplacedError::Offset => row.baro = 0.0,
        }
        let mut ours = blocks(&p);
        ours.replace(replaced, &row, (sigma * sigma) as f32);
        let mut t = M21::identity();
        t.set_row(index, &-dense_row(&row).transpose());
        let mut theirs = t * p * t.transpose();
        theirs[(index, index)] += sigma * sigma;
        let ours = dense(&ours);
        prop_assert_eq!(ours, ours.transpose());
        prop_assert!(difference(&ours, &theirs) < 1e-4, "{which}: {}", difference(&ours, &theirs));
    }

    /// A covariance that exceeds the product of its variances is found in any block and deleted.
    #[test]
    fn what_is_no_covariance_is_found(p in covariance(), i in 0..15_usize, j in 0..15_usize, sign in any::<bool>()) {
        let possible = |c: &Covariance| (0..crate::covariance::BLOCKS).all(|number| c.is_possible(number));
        prop_assert!(possible(&blocks(&p)));
        let (i, j) = (i.min(j), i.max(j));
        if i == j {
            return Ok(());
        }
        let mut wrong = p;
        let most = (p[(i, i)] * p[(j, j)]).sqrt();
        wrong[(i, j)] = if sign { 1.01 * most } else { -1.01 * most };
        wrong[(j, i)] = wrong[(i, j)];
        let mut ours = blocks(&wrong);
        prop_assert!(!possible(&ours));
        ours.decorrelate();
        prop_assert!(possible(&ours) && ours.slow.variance == blocks(&p).slow.variance);
        let variances = |c: &Covariance| dense(c).diagonal();
        prop_assert!((0..16).all(|i| (variances(&ours)[i] / variances(&blocks(&p))[i] - 2.0).abs() < 1e-5));
    }

    /// Too large a variance is scaled down with its covariances, so the matrix stays positive.
    #[test]
    fn bounds_leave_it_positive(p in covariance(), which in 0..16_usize, factor in 1e3..1e8_f64) {
        let scale = M21::from_diagonal(&V21::from_fn(|i, _| if i == which { factor } else { 1.0 }));
        let mut ours = blocks(&(scale * p * scale));
        ours.hold();
        let held = dense(&ours);
        prop_assert!(held.iter().all(|x| x.is_finite()) && held[(which, which)] < 1.001e8);
        let sigma = V21::from_fn(|i, _| held[(i, i)].sqrt());
        let correlation = M21::from_fn(|i, j| held[(i, j)] / (sigma[i] * sigma[j]));
        prop_assert!(correlation.cholesky().is_some());
    }
}

/// State with biases in `f64`.
#[derive(Clone, Copy)]
struct True {
    r: Rotation3<f64>,
    v: V3,
    p: V3,
    g: V3,
    a: V3,
}

const GRAVITY: f64 = 9.81;

/// Returns the readings of gyroscope and accelerometer at `t`.
fn shown(t: f64, a: &[f64; 6]) -> (V3, V3) {
    let rates = V3::new(2.0 * a[0] + (20.0 * t).sin(), 2.0 * a[1], 2.0 * a[2] + 10.0 * t);
    (rates, V3::new(3.0 * a[3], 3.0 * a[4] + 20.0 * t, 10.0 + 4.0 * a[5]))
}

/// Integrates back by `tau`, in steps of 0.1 ms.
fn back(mut x: True, tau: f64, a: &[f64; 6]) -> True {
    let steps = (tau / 1e-4).round() as usize;
    for i in 0..steps {
        let dt = tau / steps as f64;
        // The motion is the same for every tau.
        let (rates, force) = shown(0.3 - (i as f64 + 0.5) * dt, a);
        let before = x.r * Rotation3::new(-(rates - x.g) * dt);
        let middle = x.r * Rotation3::new(-(rates - x.g) * (0.5 * dt));
        let acceleration = middle * (force - x.a) - V3::new(0.0, 0.0, GRAVITY);
        x.p -= x.v * dt - acceleration * (0.5 * dt * dt);
        x.v -= acceleration * dt;
        x.r = before;
    }
    x
}

/// Adds an error to the state.
fn moved(x: &True, e: &V21) -> True {
    let part = |i: usize| e.fixed_rows::<3>(3 * i).into_owned();
    True { r: Rotation3::new(part(0)) * x.r, v: x.v + part(1), p: x.p + part(2), g: x.g + part(3), a: x.a + part(4) }
}

fn past(x: &True, at_us: u32) -> PastState {
    let q = UnitQuaternion::from_rotation_matrix(&x.r).into_inner();
    let single = |v: V3| v.map(|x| x as f32);
    PastState {
        at_us,
        attitude: Quaternion::new(q.w as f32, q.i as f32, q.j as f32, q.k as f32),
        velocity: single(x.v),
        position: single(x.p),
    }
}

fn angle(v: &V3) -> f64 {
    v.y.atan2(v.x)
}

proptest! {
    /// Compares every measurement's row, for ages up to 250 ms, with a finite difference: the present error is
    /// integrated back through all samples in between.
    #[test]
    fn jacobians_are_finite_differences(
        turn in numbers::<3>(), v in numbers::<3>(), p in numbers::<3>(), motion in numbers::<6>(),
        tau_ms in 0..250_u32, field in numbers::<3>(),
    ) {
        let tau = f64::from(tau_ms) * 1e-3;
        let r = Rotation3::new(V3::new(0.6 * turn[0], 0.6 * turn[1], 3.0 * turn[2]));
        let now = True { r, v: vector(v) * 5.0, p: vector(p) * 20.0, g: V3::zeros(), a: V3::zeros() };
        let then = back(now, tau, &motion);
        let at_us = 1_000_000 - tau_ms * 1000;
        let horizon = FusionHorizon::new(&past(&now, 1_000_000), &past(&then, at_us), GRAVITY as f32);
        let field = vector(field) + V3::new(1.0, 0.0, -1.5);
        // `body` is the field that the body measures.
        let body = (then.r.inverse() * field).map(|x| x as f32);
        let expected = ExpectedReadings { height_offset: 0.0, field: field.map(|x| x as f32) };
        // Derivatives by fields of the vehicle, in shares of the horizontal field.
        let level = field.xy().norm();
        let own = |axis: V3| {
            let seen = |share: f64| angle(&(then.r * axis * (level * share) + field));
            (seen(1e-4) - seen(-1e-4)) / 2e-4
        };
        let nose = |x: &True| angle(&(x.r * V3::x()));
        let upright = (then.r * V3::x()).z.abs() > 0.8 || field.z.abs() > 0.9 * field.norm();

        if !upright {
            let field = ObservedQuantity::Field(body);
            let row = horizon.row(&field, VectorComponent::X, &expected).unwrap().1.slow.unwrap();
            for (ours, theirs) in row.iter().zip([0.0, 0.0, 0.0, -own(V3::x()), -own(V3::y())]) {
                prop_assert!((f64::from(*ours) - theirs).abs() < 1e-3, "{row}, not {theirs}");
            }
        }
        for i in 0..15 {
            let step = 1e-5 * size(i) / size(0);
            let error = V21::from_fn(|j, _| if i == j { step } else { 0.0 });
            let (plus, minus) = (back(moved(&now, &error), tau, &motion), back(moved(&now, &-error), tau, &motion));
            let slope = |of: &dyn Fn(&True) -> f64| (of(&plus) - of(&minus)) / (2.0 * step);
            for (c, coordinate) in VectorComponent::ALL.into_iter().enumerate() {
                let zero = Vector3::zeros();
                let row = |target: ObservedQuantity| horizon.row(&target, coordinate, &expected).unwrap().1;
                let (p_row, v_row) = (row(ObservedQuantity::Position(zero)), row(ObservedQuantity::Velocity(zero)));
                let a_row = row(ObservedQuantity::Attitude(past(&then, 0).attitude));
                // Rotation vector of a small rotation: the skew part.
                let rotated = |x: &True| {
                    let m = (x.r * then.r.inverse()).into_inner();
                    [m.m32 - m.m23, m.m13 - m.m31, m.m21 - m.m12][c] * 0.5
                };
                let mut pairs: Vec<(&str, f64, f64)> = Vec::new();
                pairs.push(("attitude", slope(&rotated), dense_row(&a_row)[i]));
                pairs.push(("velocity", slope(&|x| x.v[c]), dense_row(&v_row)[i]));
                pairs.push(("position", slope(&|x| x.p[c]), dense_row(&p_row)[i]));
                if c == 2 {
                    let h_row = row(ObservedQuantity::Height(0.0));
                    prop_assert_eq!(h_row.baro, 1.0);
                    pairs.push(("height", slope(&|x| x.p.z), dense_row(&h_row)[i]));
                }
                if c == 0 && !upright {
                    let seen = |x: &True| angle(&(x.r * then.r.inverse() * field));
                    pairs.push(("field", slope(&seen), dense_row(&row(ObservedQuantity::Field(body)))[i]));
                    pairs.push(("heading", slope(&nose), dense_row(&row(ObservedQuantity::Heading(0.0)))[i]));
                }
                for (name, theirs, ours) in pairs {
                    // The rows leave out the effect of the gyroscope bias on velocity and position, and use the mean
                    // rotation of both ends only.
                    let bound = match (name, i / 3) {
                        ("velocity", 3) => 0.5 * 16.0 * tau * tau,
                        ("position" | "height", 3) => 16.0 * tau * tau * tau / 3.0,
                        (_, 3 | 4) => 4.0 * tau * tau * (1.0 + 3.0 * tau),
                        _ => 0.0,
                    };
                    prop_assert!(
                        (theirs - ours).abs() <= bound + 2e-3 * theirs.abs() + 2e-4,
                        "{name} {c} by error {i}: {theirs}, not {ours}; {tau} s",
                    );
                }
            }
        }
    }

    /// The history returns the state of any past time with and without corrections, so a correct measurement has no
    /// innovation.
    #[test]
    fn history_interpolates(motion in numbers::<6>(), back_us in 0..284_000_u32, by in numbers::<6>()) {
        let now = True {
            r: Rotation3::identity(),
            v: V3::new(1.0, 2.0, 3.0),
            p: V3::new(10.0, 20.0, 5.0),
            g: V3::zeros(),
            a: V3::zeros(),
        };
        let mut history = StateHistory::default();
        let base = u32::MAX - 100_000;
        for i in (0..72).rev() {
            let x = back(now, f64::from(i) * 4e-3, &motion.map(|x| x * 0.3));
            history.store(&past(&x, base.wrapping_add(284_000 - i * 4000)));
        }
        let at_us = base.wrapping_add(284_000 - back_us);
        let x = back(now, f64::from(back_us) * 1e-6, &motion.map(|x| x * 0.3));
        let g = GRAVITY as f32;
        let found = history.corrected(&history.at(at_us).unwrap(), g).unwrap();
        prop_assert!((found.position.map(f64::from) - x.p).norm() < 1e-4);
        prop_assert!((found.velocity.map(f64::from) - x.v).norm() < 2e-3);
        let q = past(&x, 0).attitude;
        prop_assert!(1.0 - q.dot(&found.attitude).abs() < 1e-6);
        // A correction of the present must equal the past that would have led to it: the same samples integrated back
        // from the corrected state.
        let part = |i: usize, size: f64| vector([by[i], by[i + 1], by[i + 2]]) * size;
        let (theta, v, p) = (part(0, 0.02), part(3, 1.0), part(1, 5.0));
        let single = |v: &V3| v.map(|x| x as f32);
        let (turn, theta_f) = (crate::rotation::small(&single(&theta)), single(&theta));
        history.correct(&turn, &theta_f, &single(&v), &single(&p));
        let corrected = history.corrected(&history.at(at_us).unwrap(), g).unwrap();
        let error = V21::from_iterator(theta.iter().chain(&v).chain(&p).copied().chain([0.0; 12]));
        let y = back(moved(&now, &error), f64::from(back_us) * 1e-6, &motion.map(|x| x * 0.3));
        prop_assert!((corrected.velocity.map(f64::from) - y.v).norm() < 4e-3);
        prop_assert!((corrected.position.map(f64::from) - y.p).norm() < 1e-3);
        prop_assert!(1.0 - past(&y, 0).attitude.dot(&corrected.attitude).abs() < 1e-6);
        // Applying the correction to the stored history changes no past state.
        history.settle(g);
        let settled = history.corrected(&history.at(at_us).unwrap(), g).unwrap();
        prop_assert!((corrected.position - settled.position).norm() < 2e-4 && !history.is_unsettled());
        prop_assert!((corrected.velocity - settled.velocity).norm() < 2e-3);
        // Times before the oldest or after the newest entry return `None`.
        prop_assert!(history.at(base.wrapping_add(284_001)).is_none());
        prop_assert!(history.at(u32::MAX - 100_001).is_none());
    }

    #[test]
    fn angles(x in -10.0..10.0_f32, y in -10.0..10.0_f32, v in numbers::<3>()) {
        prop_assert!((f64::from(crate::rotation::atan2(y, x)) - f64::from(y).atan2(f64::from(x))).abs() < 4e-7);
        let q = UnitQuaternion::new(vector(v) * 1.7);
        let single = q.into_inner().coords.map(|x| x as f32);
        let ours = crate::rotation::euler(&Quaternion::from(single));
        let (roll, pitch, yaw) = q.euler_angles();
        prop_assert!((ours.map(f64::from) - V3::new(roll, pitch, yaw)).norm() < 2e-5 || pitch.abs() > 1.5);
        let turn = vector(v) * 0.3;
        let small = crate::rotation::small(&turn.map(|x| x as f32));
        let exact = UnitQuaternion::new(turn);
        prop_assert!((small.coords.map(f64::from) - exact.coords).norm() < 2e-7);
        let back = crate::rotation::difference(&small, &crate::rotation::identity());
        prop_assert!((back.map(f64::from) - turn).norm() < 1e-6);
    }
}

//! Checks the fusion of a queued measurement against a dense Kalman filter in `f64`.

extern crate std;

use super::memory;
use super::{M21, V3, V21, covariance, dense, dense_row, difference, numbers, vector};
use crate::aid::AidSource;
use crate::errors::VectorComponent;
use crate::estimator::Estimator;
use crate::horizon::{ExpectedReadings, FusionHorizon, ObservedQuantity};
use crate::measurement::Measurement;
use crate::memory::Memory;
use crate::settings::Settings;
use afbc_types::Stamped;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use proptest::prelude::*;
use std::vec::Vec;

const NOW_US: u64 = 1_000_000;

/// Standard deviation of each measured coordinate.
const SIGMA: f64 = 0.05;

fn estimator() -> Estimator {
    // Slow errors stay as they are in the covariance, and a receiver's reported deviation is all noise.
    Estimator::new(Settings { gnss_noise_m: 100.0, mag_slow_rad: 0.0, reacquire_s: 60.0, ..Settings::DEFAULT }).unwrap()
}

/// Removes the slow errors and shrinks the rotation errors, so that the filter is linear.
fn linear(p: M21) -> M21 {
    let scale = V21::from_fn(|i, _| match i {
        0..3 => 0.05,
        16.. => 0.0,
        _ => 1.0,
    });
    let scaled = M21::from_diagonal(&scale) * p * M21::from_diagonal(&scale);
    dense(&super::blocks(&scaled))
}

/// Returns a measurement that differs from the estimate's expectation by `by`.
fn measurement(aid: AidSource, memory: &Memory, by: V3) -> Measurement {
    let off = by.map(|x| x as f32);
    let n = &memory.nominal;
    match aid {
        AidSource::TrackerPosition => Measurement::Position { position_m: n.position + off, sigma_m: SIGMA as f32 },
        AidSource::GnssPosition => Measurement::Gnss {
            position_m: n.position + Vector3::new(off.x, off.y, 0.0),
            velocity_m_s: n.velocity,
            horizontal_sigma_m: SIGMA as f32,
            vertical_sigma_m: 1e4,
            speed_sigma_m_s: 1e3,
            climb_sigma_m_s: 1e3,
        },
        AidSource::GnssHeight => Measurement::Gnss {
            position_m: n.position + Vector3::new(0.0, 0.0, off.x),
            velocity_m_s: n.velocity,
            horizontal_sigma_m: 1e4,
            vertical_sigma_m: SIGMA as f32,
            speed_sigma_m_s: 1e3,
            climb_sigma_m_s: 1e3,
        },
        AidSource::GnssVelocity => Measurement::Gnss {
            position_m: n.position,
            velocity_m_s: n.velocity + off,
            horizontal_sigma_m: 1e4,
            vertical_sigma_m: 1e4,
            speed_sigma_m_s: SIGMA as f32,
            climb_sigma_m_s: SIGMA as f32,
        },
        AidSource::TrackerAttitude => {
            let q = UnitQuaternion::new(by).into_inner().coords.map(|x| x as f32);
            let q = Quaternion::from(q) * n.attitude;
            Measurement::Pose {
                position_m: n.position,
                attitude: [q.w, q.i, q.j, q.k],
                position_sigma_m: 1e4,
                attitude_sigma_rad: SIGMA as f32,
            }
        }
        AidSource::Height => {
            Measurement::Height { height_m: n.position.z + memory.height_offset + off.x, sigma_m: SIGMA as f32 }
        }
        AidSource::Heading => {
            Measurement::Heading { heading_rad: crate::rotation::euler(&n.attitude).z + off.x, sigma_rad: SIGMA as f32 }
        }
    }
}

/// Returns the Jacobian rows of the measurement at the present.
fn rows(aid: AidSource, memory: &Memory) -> Vec<V21> {
    let past = memory.history.newest().unwrap();
    let horizon = FusionHorizon::new(&past, &past, 9.81);
    let expected = ExpectedReadings { height_offset: 0.0, field: Vector3::x() };
    let zero = Vector3::zeros();
    let (target, count) = match aid {
        AidSource::TrackerPosition => (ObservedQuantity::Position(zero), 3),
        AidSource::GnssPosition => (ObservedQuantity::Position(zero), 2),
        AidSource::GnssHeight => (ObservedQuantity::Position(zero), 1),
        AidSource::GnssVelocity => (ObservedQuantity::Velocity(zero), 3),
        AidSource::TrackerAttitude => (ObservedQuantity::Attitude(past.attitude), 3),
        AidSource::Height => (ObservedQuantity::Height(0.0), 1),
        AidSource::Heading => (ObservedQuantity::Heading(0.0), 1),
    };
    let row = |at: &VectorComponent| dense_row(&horizon.row(&target, *at, &expected).unwrap().1);
    let first = if aid == AidSource::GnssHeight { 2 } else { 0 };
    VectorComponent::ALL.iter().skip(first).take(count).map(row).collect()
}

/// Fuses until the queue is empty.
fn fuse(memory: &mut Memory, value: Measurement) {
    memory.offer(&Stamped { value, at_us: NOW_US });
    memory.still_us = NOW_US;
    for _ in 0..20 {
        estimator().fuse(memory, NOW_US);
    }
    assert!(memory.queue.waiting() == 0 && memory.fix.is_none());
}

fn start(p: &M21, turn: &V3, offset: f64) -> Memory {
    let mut memory = memory(p, turn);
    memory.height_offset = offset as f32;
    memory
}

const AIDS: [AidSource; 7] = AidSource::ALL;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    /// Fusing scalar by scalar gives the state, covariance and normalised innovation squared of a matrix update.
    #[test]
    fn a_fix_is_a_kalman_update(
        p in covariance(), turn in numbers::<3>(), by in numbers::<3>(), which in 0..7_usize, offset in -3.0..3.0_f64,
    ) {
        let (p, aid) = (linear(p), AIDS[which]);
        let mut ours = start(&p, &(vector(turn) * 0.4), offset);
        let before = ours;
        // The other parts of the same fix have so much noise that they hardly matter.
        let h = rows(aid, &ours);
        let by = vector(by) * SIGMA;
        fuse(&mut ours, measurement(aid, &before, by));
        let (mut q, mut x, mut nis) = (p, V21::zeros(), 0.0);
        for (i, h) in h.iter().enumerate() {
            let s = h.dot(&(q * h)) + SIGMA * SIGMA;
            let k = q * h / s;
            let nu = by[i] - h.dot(&x);
            (x, nis) = (x + k * nu, nis + nu * nu / s);
            let i = M21::identity() - k * h.transpose();
            q = i * q * i.transpose() + k * k.transpose() * (SIGMA * SIGMA);
        }
        let record = *ours.aids().of(aid);
        prop_assert_eq!((record.accepted, record.rejected, usize::from(record.scalars)), (1, 0, h.len()));
        prop_assert!((f64::from(record.nis) - nis).abs() < 2e-2 * (1.0 + nis), "{} {nis}", record.nis);
        // The next prediction will rotate the rotation error, so it is excluded here.
        let unturned = dense(&ours.covariance);
        let sub = |m: &M21| M21::from_fn(|i, j| if i < 16 && j < 16 { m[(i, j)] } else if i == j { 1.0 } else { 0.0 });
        let off = difference(&sub(&unturned), &sub(&q));
        prop_assert!(off < 5e-3, "{aid:?}: {off}");
        let moved = |a: Vector3<f32>, b: Vector3<f32>| (a - b).map(f64::from);
        let (now, then) = (&ours.nominal, &before.nominal);
        let turned = crate::rotation::difference(&now.attitude, &then.attitude).map(f64::from);
        let parts = [
            turned, moved(now.velocity, then.velocity), moved(now.position, then.position),
            moved(now.gyro_bias, then.gyro_bias), moved(now.accel_bias, then.accel_bias),
        ];
        for (k, part) in parts.iter().enumerate() {
            for c in 0..3 {
                let sigma = p[(3 * k + c, 3 * k + c)].sqrt();
                let off = (part[c] - x[3 * k + c]).abs();
                prop_assert!(off < 0.02 * sigma, "{aid:?} {k} {c}: off by {off}, sigma {sigma}");
            }
        }
        let offset = f64::from(ours.height_offset - before.height_offset);
        prop_assert!((offset - x[15]).abs() < 0.02 * p[(15, 15)].sqrt(), "{aid:?}: {offset} {}", x[15]);
        // The history was corrected too.
        let newest = ours.history.newest().unwrap();
        prop_assert!((newest.position - now.position).norm() < 1e-4 && (newest.velocity - now.velocity).norm() < 1e-4);
    }

    /// A scalar just within five standard deviations of the innovation is fused, and one just beyond is not, in each
    /// coordinate.
    #[test]
    fn the_gate_is_at_five_sigma(p in covariance(), which in 0..7_usize, c in 0..3_usize, sign in any::<bool>()) {
        let (p, aid) = (linear(p), AIDS[which]);
        let memory = start(&p, &V3::new(0.1, -0.15, 0.4), 1.0);
        let h = rows(aid, &memory);
        let c = c.min(h.len() - 1);
        let sigma = (h[c].dot(&(p * h[c])) + SIGMA * SIGMA).sqrt();
        let sign = if sign { 1.0 } else { -1.0 };
        for (sigmas, fused) in [(4.9, true), (5.1, false)] {
            let mut memory = memory;
            let before = memory.nominal;
            let by = V3::from_fn(|i, _| if i == c { sign * sigmas * sigma } else { 0.0 });
            let value = measurement(aid, &memory, by);
            fuse(&mut memory, value);
            let record = memory.aids().of(aid);
            let expected = (u32::from(fused), u32::from(!fused));
            prop_assert_eq!((record.accepted, record.rejected), expected, "{:?} {}", aid, sigmas);
            prop_assert!(fused || (f64::from(record.nis) - sigmas * sigmas).abs() < 0.5, "{}", record.nis);
            prop_assert_eq!(memory.resets, start(&p, &V3::zeros(), 0.0).resets);
            prop_assert!(fused || memory.nominal == before);
        }
    }

    /// The gate of a late position includes the effect of the velocity error since then.
    #[test]
    fn the_gate_of_a_late_position(p in covariance(), tau_ms in 4..240_u32, c in 0..3_usize) {
        let p = linear(p);
        let tau = f64::from(tau_ms) * 1e-3;
        let mut memory = memory(&p, &V3::zeros());
        memory.history.clear();
        let (velocity, position) = (memory.nominal.velocity, memory.nominal.position);
        let steps = 60;
        for i in (0..=steps).rev() {
            let at_us = NOW_US - u64::from(i * 4000_u32);
            let back = (NOW_US - at_us) as f32 * 1e-6;
            memory.history.store(&crate::history::PastState {
                at_us: at_us as u32, attitude: memory.nominal.attitude, velocity, position: position - velocity * back,
                    });
        }
        let place = position - velocity * (tau as f32);
        let i = 6 + c;
        let j = 3 + c;
        let variance = p[(i, i)] - 2.0 * tau * p[(j, i)] + tau * tau * p[(j, j)] + SIGMA * SIGMA;
        for (sigmas, fused) in [(4.85, true), (5.15, false)] {
            let mut memory = memory;
            let by = Vector3::from_fn(|k, _| if k == c { (sigmas * variance.sqrt()) as f32 } else { 0.0 });
            let value = Measurement::Position { position_m: place + by, sigma_m: SIGMA as f32 };
            memory.offer(&Stamped { value, at_us: NOW_US - u64::from(tau_ms) * 1000 });
            for _ in 0..6 {
                estimator().fuse(&mut memory, NOW_US);
            }
            prop_assert_eq!(memory.aids().tracker_position.accepted, u32::from(fused), "{}", sigmas);
        }
    }
}

/// Of a receiver's variance, `gnss_noise_m` is noise and the rest is slow error, which fades from fix to fix.
#[test]
fn a_receivers_variance_is_divided() {
    let settings = Settings { gnss_noise_m: 0.5, gnss_slow_s: 100.0, ..Settings::DEFAULT };
    let estimator = Estimator::new(settings).unwrap();
    let mut memory = memory(&linear(M21::identity() * 0.01), &V3::zeros());
    let fix = |at_us, sigma: f32| Stamped {
        value: Measurement::Gnss {
            position_m: Vector3::new(3.0, 4.0, 5.0),
            velocity_m_s: Vector3::new(1.0, -2.0, 0.5),
            horizontal_sigma_m: sigma,
            vertical_sigma_m: 0.4,
            speed_sigma_m_s: 10.0,
            climb_sigma_m_s: 10.0,
        },
        at_us,
    };
    memory.offer(&fix(NOW_US, 1.3));
    estimator.fuse(&mut memory, NOW_US);
    let slow = memory.covariance.slow.gnss_variance();
    assert!((slow - Vector3::new(1.44, 1.44, 0.0)).norm() < 1e-5, "{slow}");
    for _ in 0..10 {
        estimator.fuse(&mut memory, NOW_US);
    }
    let kept = memory.covariance.slow.position;
    assert!(kept.m11 < -1e-4);
    // After ten seconds, nine tenths of the covariance are left.
    memory.store_history(NOW_US + 10_000_000);
    memory.still_us = NOW_US + 10_000_000;
    let mut later = memory;
    later.offer(&fix(NOW_US + 10_000_000, 1.3));
    let before = later.covariance.slow.position.m11;
    later.covariance.slow.follow(&slow, 0.9);
    assert!((later.covariance.slow.position.m11 / before - 0.9).abs() < 1e-5);
}

//! Checks growing faults, reflections, and wrong stamps of a receiver on otherwise perfect instruments.
#![allow(clippy::unwrap_used, clippy::panic, clippy::float_cmp, missing_docs)] // tests

use crate::common::{STEP_S, assert_correlation, assert_sigma_of, coordinates, rest, rotation, run, run_with};
use afbc_plant::instruments::{FailureKind, GnssModel, ImuModel, InstrumentFault, MagnetometerModel, TrackerModel};
use afbc_plant::{InstrumentReadings, InstrumentSuite, SimulatedInstruments};
use nalgebra::{Quaternion, Vector3};

fn suite() -> InstrumentSuite {
    InstrumentSuite {
        imu: Some(ImuModel::DEFAULT),
        tracker: Some(TrackerModel::DEFAULT),
        gnss: Some(GnssModel::DEFAULT),
        magnetometer: Some(MagnetometerModel::DEFAULT),
        ..InstrumentSuite::default()
    }
}

/// Returns the readings of three seconds with a fault from 1 s on.
fn flown(failure: FailureKind, rise_s: f64) -> Vec<InstrumentReadings> {
    let fault = InstrumentFault { failure, start_s: 1.0, end_s: f64::INFINITY, rise_s };
    run_with(suite(), &[fault], 1, 3000, |_| rest())
}

/// Returns the share of a fault that acts at this time, with a rise of half a second.
fn share(time_s: f64) -> f64 {
    ((time_s - 1.0) / 0.5).clamp(0.0, 1.0)
}

#[test]
fn a_fault_with_a_rise_grows_evenly_to_its_size() {
    let (by_m, yaw_rad) = (Vector3::new(5.0, -3.0, 20.0), 0.4);
    let rates = Vector3::new(0.01, -0.02, 0.03);
    let near = |found: Vector3<f64>, wanted: Vector3<f64>| assert!((found - wanted).norm() < 1e-6, "{found} {wanted}");
    let at = |k: usize| k as f64 * STEP_S;
    let fixes = flown(FailureKind::GnssJumped { by_m }, 0.5);
    for (k, fix) in (0..).zip(&fixes).flat_map(|(k, read)| read.gnss.iter().map(move |fix| (k, fix))) {
        near(fix.position_m, by_m * share(at(k)));
    }
    let biased = FailureKind::ImuBiased { rates_bias_rad_s: rates, force_bias_m_s2: rates * 10.0 };
    for (k, read) in flown(biased, 0.5).into_iter().enumerate() {
        let imu = read.imu.unwrap();
        near(imu.rates_rad_s, rates * share(at(k)));
        near(imu.specific_force_m_s2 - Vector3::z() * 9.81, rates * 10.0 * share(at(k)));
    }
    let disturbed = flown(FailureKind::MagnetometerDisturbed { field_ut: by_m }, 0.5);
    for (k, fix) in (0..).zip(&disturbed).flat_map(|(k, read)| read.magnetometer.iter().map(move |fix| (k, fix))) {
        near(fix.field_ut - MagnetometerModel::DEFAULT.earth_field_ut(), by_m * share(at(k)));
    }
    let slipped = flown(FailureKind::TrackerJumped { by_m, yaw_rad }, 0.5);
    for (k, fix) in (0..).zip(&slipped).flat_map(|(k, read)| read.tracker.iter().map(move |fix| (k, fix))) {
        near(fix.position_m, by_m * share(at(k)));
        let half = 0.5 * yaw_rad * share(at(k));
        near(rotation(fix.attitude * Quaternion::new(half.cos(), 0.0, 0.0, -half.sin())), Vector3::zeros());
    }
}

/// Without a rise, a fault has its full size at once. Only failures with a size can be scaled.
#[test]
fn without_a_rise_a_fault_is_there_at_once() {
    let by_m = Vector3::new(5.0, -3.0, 20.0);
    let fixes = flown(FailureKind::GnssJumped { by_m }, 0.0);
    for (k, fix) in (0..).zip(&fixes).flat_map(|(k, read)| read.gnss.iter().map(move |fix| (k, fix))) {
        assert_eq!(fix.position_m, if k < 1000 { Vector3::zeros() } else { by_m });
    }
    for failure in FailureKind::ALL {
        assert!(failure.scaled(1.0).is_none_or(|whole| whole == failure), "{failure:?}");
    }
    assert_eq!(FailureKind::ImuDead.scaled(0.5), None);
    let endless =
        InstrumentFault { failure: FailureKind::GnssJumped { by_m }, start_s: 1.0, end_s: 2.0, rise_s: f64::INFINITY };
    let refused = SimulatedInstruments::new(&suite(), &[endless], 1, STEP_S).unwrap_err();
    assert_eq!(refused.range.name, "rise_s");
}

/// Over many receivers the reflections are a stationary process from the onset on, with their spread and correlation in
/// time, and end with the fault.
#[test]
fn reflections_have_their_spread_and_correlation_and_end() {
    let failure = FailureKind::GnssMultipath { deviation_m: 5.0, correlation_time_s: 0.5 };
    let fault = InstrumentFault { failure, start_s: 1.0, end_s: 2.0, rise_s: 0.0 };
    let alone =
        InstrumentSuite { gnss: Some(GnssModel { rate_hz: 4.0, ..GnssModel::DEFAULT }), ..InstrumentSuite::default() };
    let (mut first, mut later, mut pairs) = (Vec::new(), Vec::new(), Vec::new());
    for seed in 0..400 {
        let readings = run_with(alone, &[fault], seed, 3000, |_| rest());
        let fixes: Vec<_> = readings.into_iter().flat_map(|read| read.gnss).collect();
        for fix in fixes.iter().filter(|fix| !(0.999..1.999).contains(&fix.true_at_s)) {
            assert_eq!(fix.position_m, Vector3::zeros());
        }
        let ill: Vec<_> = fixes.iter().filter(|fix| (0.999..1.999).contains(&fix.true_at_s)).collect();
        let [a, b, c, _] = ill.as_slice() else { panic!("{} fixes", ill.len()) };
        first.push(a.position_m);
        later.push(c.position_m);
        pairs.extend(a.position_m.iter().zip(&b.position_m).map(|(a, b)| (*a, *b)));
    }
    assert_sigma_of(&coordinates(first), 5.0, 1200.0, "at the onset");
    assert_sigma_of(&coordinates(later), 5.0, 1200.0, "later");
    // Consecutive fixes are a quarter of a second apart, which is half of the correlation time.
    assert_correlation(&pairs, 5.0, (-0.5_f64).exp(), "from fix to fix");
}

/// A wrong stamp shifts the stated time, but neither the measurement nor the time at which a fault acts.
#[test]
fn a_receivers_stamps_are_late_by_what_is_stated() {
    let with = |stamp_s| {
        let suite =
            InstrumentSuite { gnss: Some(GnssModel { stamp_s, ..GnssModel::M10 }), ..InstrumentSuite::default() };
        let failure = FailureKind::GnssJumped { by_m: Vector3::x() };
        let fault = InstrumentFault { failure, start_s: 1.0, end_s: 2.0, rise_s: 0.0 };
        let [well, ill] = [run(suite, 3, 3000, |_| rest()), run_with(suite, &[fault], 3, 3000, |_| rest())];
        [well, ill].map(|readings| readings.into_iter().flat_map(|read| read.gnss).collect::<Vec<_>>())
    };
    for (right, late) in with(0.0).into_iter().flatten().zip(with(0.15).into_iter().flatten()) {
        assert_eq!((right.position_m, right.velocity_m_s), (late.position_m, late.velocity_m_s));
        assert!((late.true_at_s - right.true_at_s - 0.15).abs() < 1e-12);
    }
}

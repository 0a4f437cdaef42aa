//! Compares GNSS receiver, barometer and magnetometer with their declared properties, within five standard errors and
//! with fixed seeds.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::float_cmp, missing_docs)] // tests

use crate::common::{STEP_S, assert_correlation, assert_sigma, coordinates, mean, rest, run};
use afbc_plant::instruments::{BarometerModel, GnssModel, MagnetometerModel};
use afbc_plant::{InstrumentSuite, MeasurementDropouts, Truth};
use nalgebra::{UnitQuaternion, Vector3};

fn gnss(gnss: GnssModel) -> InstrumentSuite {
    InstrumentSuite { gnss: Some(gnss), ..InstrumentSuite::default() }
}

fn barometer(barometer: BarometerModel) -> InstrumentSuite {
    InstrumentSuite { barometer: Some(barometer), ..InstrumentSuite::default() }
}

fn magnetometer(magnetometer: MagnetometerModel) -> InstrumentSuite {
    InstrumentSuite { magnetometer: Some(magnetometer), ..InstrumentSuite::default() }
}

fn moving(k: u32) -> Truth {
    let velocity_m_s = Vector3::new(1.0, 0.001 * f64::from(k), -2.0);
    Truth { position_m: Vector3::new(f64::from(k), 5.0, 7.0), velocity_m_s, ..rest() }
}

#[test]
fn perfect_ones_read_the_truth() {
    let suite = InstrumentSuite {
        gnss: Some(GnssModel::DEFAULT),
        barometer: Some(BarometerModel::DEFAULT),
        magnetometer: Some(MagnetometerModel::DEFAULT),
        ..InstrumentSuite::default()
    };
    let readings = run(suite, 1, 1000, moving);
    let (mut fixes, mut heights, mut fields) = (0, 0, 0);
    for (k, readings) in (0..).zip(readings) {
        for fix in readings.gnss {
            fixes += 1;
            assert_eq!((fix.position_m, fix.velocity_m_s), (moving(k).position_m, moving(k).velocity_m_s));
            assert_eq!(fix.true_at_s, f64::from(k) * STEP_S);
        }
        for fix in readings.barometer {
            heights += 1;
            assert_eq!((fix.height_m, fix.true_at_s), (7.0, f64::from(k) * STEP_S));
        }
        for fix in readings.magnetometer {
            fields += 1;
            assert_eq!(
                (fix.field_ut, fix.true_at_s),
                (MagnetometerModel::DEFAULT.earth_field_ut(), f64::from(k) * STEP_S)
            );
        }
    }
    assert_eq!((fixes, heights, fields), (10, 50, 50));
}

/// Over many flights, the position error is a stationary Gauss-Markov process plus noise: the correlation of fixes one
/// correlation time apart is the slow part's share divided by e.
#[test]
fn gnss_errors_have_their_spread_and_correlation() {
    let settings = GnssModel {
        horizontal_m: 1.5,
        vertical_m: 3.0,
        noise_m: 0.5,
        correlation_time_s: 0.4,
        velocity_m_s: 0.1,
        reported: 0.8,
        ..GnssModel::DEFAULT
    };
    let (mut level, mut up, mut velocity) = (Vec::new(), Vec::new(), Vec::new());
    for seed in 0..4000 {
        let fixes: Vec<_> = run(gnss(settings), seed, 401, |_| rest()).into_iter().flat_map(|r| r.gnss).collect();
        assert_eq!(fixes.len(), 5);
        let [first, .., last] = fixes.as_slice() else { unreachable!() };
        level.extend([(first.position_m.x, last.position_m.x), (first.position_m.y, last.position_m.y)]);
        up.push((first.position_m.z, last.position_m.z));
        velocity.extend((0..3).map(|i| (first.velocity_m_s[i], last.velocity_m_s[i])));
        assert_eq!(first.horizontal_sigma_m, 0.8 * (1.5_f64 * 1.5 + 0.25).sqrt());
        assert_eq!(first.vertical_sigma_m, 0.8 * (9.0_f64 + 0.25).sqrt());
        assert_eq!(first.velocity_sigma_m_s, 0.8 * 0.1);
    }
    for (pairs, slow, noise) in [(level, 1.5, 0.5), (up, 3.0, 0.5), (velocity, 0.0, 0.1)] {
        let sigma = f64::hypot(slow, noise);
        let (first, last): (Vec<f64>, Vec<f64>) = pairs.iter().copied().unzip();
        assert_sigma(&first, sigma, "first");
        assert_sigma(&last, sigma, "last");
        let correlation = (slow / sigma).powi(2) * (-1.0_f64).exp();
        assert_correlation(&pairs, sigma, correlation, "one correlation time apart");
    }
}

/// A fix belongs to its stamp and arrives after its delay. A loss takes its share of fixes and changes no other fix's
/// error.
#[test]
fn gnss_is_late_and_gets_lost() {
    let settings = GnssModel { delay_s: 0.12, jitter_s: 0.01, ..GnssModel::DEFAULT };
    let arrivals = |settings| {
        let readings = run(gnss(settings), 3, 1_000_000, moving);
        let fixes = (0..).zip(readings).flat_map(|(k, r)| r.gnss.into_iter().map(move |fix| (k, fix)));
        fixes.collect::<Vec<(u32, _)>>()
    };
    let all = arrivals(GnssModel { noise_m: 0.1, ..settings });
    for (k, fix) in &all {
        let late = k - (fix.true_at_s / STEP_S).round() as u32;
        assert!((110..=130).contains(&late), "{late}");
        assert!((fix.position_m.x - fix.true_at_s / STEP_S).abs() < 1.0);
    }
    let lossy =
        arrivals(GnssModel { noise_m: 0.1, loss: MeasurementDropouts { rate_hz: 0.1, mean_s: 1.0 }, ..settings });
    let mut kept = all.iter();
    assert!(lossy.iter().all(|fix| kept.any(|other| other == fix)));
    // Expected share 0.1/(0.1 + 1), over 1000 s in which a state lasts 0.9 s.
    let share = 1.0 - lossy.len() as f64 / all.len() as f64;
    let p = 1.0 / 11.0;
    assert!((share - p).abs() < 5.0 * (p * (1.0 - p) * 2.0 * 0.91 / 1000.0_f64).sqrt(), "{share}");
}

#[test]
fn a_barometer_has_noise_offset_and_drift() {
    let settings =
        BarometerModel { noise_m: 0.1, offset_m: 2.0, drift_m: 0.5, drift_time_s: 0.2, ..BarometerModel::DEFAULT };
    let (mut pairs, mut quiet) = (Vec::new(), Vec::new());
    for seed in 0..4000 {
        let heights = |settings| -> Vec<f64> {
            let readings = run(barometer(settings), seed, 201, |_| rest()).into_iter();
            readings.flat_map(|r| r.barometer).map(|fix| fix.height_m).collect()
        };
        let found = heights(BarometerModel { offset_m: 0.0, ..settings });
        pairs.push((found[0], found[10]));
        quiet.push(heights(BarometerModel { noise_m: 0.0, drift_m: 0.0, ..settings })[3]);
    }
    let sigma = f64::hypot(0.1, 0.5);
    let (first, last): (Vec<f64>, Vec<f64>) = pairs.iter().copied().unzip();
    assert_sigma(&first, sigma, "first");
    assert_sigma(&last, sigma, "last");
    assert_correlation(&pairs, sigma, (-1.0_f64).exp() * 0.25 / (0.25 + 0.01), "drift");
    assert_sigma(&quiet, 2.0, "offset");

    let stepped =
        run(barometer(BarometerModel { noise_m: 0.1, lsb_m: 0.05, ..BarometerModel::DEFAULT }), 1, 1000, |_| rest());
    assert!(stepped.iter().flat_map(|r| &r.barometer).all(|fix| {
        let steps = fix.height_m / 0.05;
        (steps - steps.round()).abs() < 1e-9
    }));
    let late = run(barometer(BarometerModel { delay_s: 0.015, ..BarometerModel::DEFAULT }), 1, 100, moving);
    for (k, fix) in (0..).zip(&late).flat_map(|(k, r)| r.barometer.iter().map(move |fix| (k, fix))) {
        assert!((f64::from(k) * STEP_S - fix.true_at_s - 0.015).abs() < 1e-12);
    }
}

/// The wash lowers the height in proportion to the thrust, and by a factor of e per `wash_height_m`.
#[test]
fn wash_under_the_rotors_lowers_the_height_near_the_ground() {
    let settings = BarometerModel { wash_m: 0.6, wash_height_m: 0.4, ..BarometerModel::DEFAULT };
    let error = |height_m: f64, thrust_share: f64| {
        let truth = Truth { position_m: Vector3::z() * height_m, thrust_share, ..rest() };
        run(barometer(settings), 1, 1, |_| truth)[0].barometer[0].height_m - height_m
    };
    assert!((error(0.0, 1.0) + 0.6).abs() < 1e-12);
    assert!((error(0.4, 1.0) + 0.6 * (-1.0_f64).exp()).abs() < 1e-12);
    assert!((error(0.8, 2.0) + 1.2 * (-2.0_f64).exp()).abs() < 1e-12);
    assert!((error(-0.01, 1.0) + 0.6).abs() < 1e-12, "in a dent of the ground");
    assert_eq!(error(0.1, 0.0), 0.0);
    assert!(error(10.0, 1.0).abs() < 1e-9);
}

/// Without errors, the field is the earth's in body axes: north and down, turned east by the declination.
#[test]
fn the_field_is_the_earths() {
    let settings = MagnetometerModel { strength_ut: 50.0, inclination_rad: 1.0, ..MagnetometerModel::DEFAULT };
    let field = settings.earth_field_ut();
    assert!((field - Vector3::new(50.0 * 1.0_f64.cos(), 0.0, -50.0 * 1.0_f64.sin())).norm() < 1e-12);
    let east = MagnetometerModel { declination_rad: 0.1, ..settings }.earth_field_ut();
    assert!(east.y < 0.0 && ((-east.y).atan2(east.x) - 0.1).abs() < 1e-12 && (east.norm() - 50.0).abs() < 1e-12);
    for angles in [[0.0, 0.0, 1.0], [0.4, -0.5, 2.0], [3.0, 0.1, -1.0]] {
        let attitude = UnitQuaternion::from_euler_angles(angles[0], angles[1], angles[2]);
        let truth = Truth { attitude: attitude.into_inner(), ..rest() };
        let measured = run(magnetometer(settings), 1, 1, |_| truth)[0].magnetometer[0].field_ut;
        assert!((measured - attitude.inverse() * field).norm() < 1e-9);
    }
}

/// The measurement is soft * field + hard + motor * thrust, with parts drawn once per flight.
#[test]
fn iron_and_motors_distort_the_field() {
    let settings = MagnetometerModel {
        hard_iron_ut: 4.0,
        soft_iron: 0.05,
        motor_ut: Vector3::new(1.0, -2.0, 3.0),
        ..MagnetometerModel::DEFAULT
    };
    let (mut hard, mut soft) = (Vec::new(), Vec::new());
    for seed in 0..3000 {
        let at = |attitude: UnitQuaternion<f64>, thrust_share: f64| {
            let truth = Truth { attitude: attitude.into_inner(), thrust_share, ..rest() };
            run(magnetometer(settings), seed, 1, |_| truth)[0].magnetometer[0].field_ut
        };
        let level = UnitQuaternion::identity();
        let idle = at(level, 0.0);
        assert!((at(level, 1.5) - idle - settings.motor_ut * 1.5).norm() < 1e-9);
        // Three half turns and the level attitude turn the field into four fields that sum to zero.
        let turned = [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()]
            .map(|axis| UnitQuaternion::from_axis_angle(&axis, core::f64::consts::PI));
        let all = [idle, at(turned[0], 0.0), at(turned[1], 0.0), at(turned[2], 0.0)];
        hard.push((all[0] + all[1] + all[2] + all[3]) / 4.0);
        // The field along x alone, from the attitudes that keep x, gives a column of the soft iron.
        let column = (all[0] + all[1] - all[2] - all[3]) / (4.0 * settings.earth_field_ut().x);
        soft.push(column - Vector3::x());
    }
    assert_sigma(&coordinates(hard), 4.0, "hard iron");
    assert_sigma(&coordinates(soft), 0.05, "soft iron");
}

#[test]
fn a_magnetometer_is_noisy_quantised_clipped_and_late() {
    let settings = MagnetometerModel { noise_ut: 2.0, rate_hz: 1000.0, ..MagnetometerModel::DEFAULT };
    let fields = |settings| -> Vec<Vector3<f64>> {
        run(magnetometer(settings), 2, 50_000, |_| rest())
            .into_iter()
            .flat_map(|r| r.magnetometer)
            .map(|f| f.field_ut)
            .collect()
    };
    let noise = coordinates(fields(settings).into_iter().map(|field| field - settings.earth_field_ut()));
    assert_sigma(&noise, 2.0, "noise");
    assert!(mean(&noise).abs() < 5.0 * 2.0 / (noise.len() as f64).sqrt());
    let coarse = fields(MagnetometerModel { lsb_ut: 0.3, range_ut: 45.0, ..settings });
    assert!(coarse.iter().all(|field| field.amax() <= 45.0 + 1e-9));
    assert!(coarse.iter().flatten().all(|value| (value / 0.3 - (value / 0.3).round()).abs() < 1e-9));
    let late = run(magnetometer(MagnetometerModel { delay_s: 0.01, ..settings }), 1, 100, |_| rest());
    assert!(late[..10].iter().all(|r| r.magnetometer.is_empty()));
    assert!(late[10..].iter().all(|r| r.magnetometer.len() == 1));
}

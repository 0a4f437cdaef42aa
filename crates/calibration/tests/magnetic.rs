//! Tests the magnetometer calibration with simulated sensors, whose errors are known.
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, missing_docs, reason = "tests")]

mod common;

use afbc_calibration::{
    CalibrationEvent, CalibrationFailure, FieldFit, FieldSums, MagnetometerCalibration, RawSample, Side,
};
use afbc_plant::InstrumentSuite;
use afbc_plant::instruments::{ImuModel, MagnetometerModel as Part};
use afbc_types::{Mounting, SensorCalibration};
use common::{Hands, keep};
use nalgebra::{Matrix3, Rotation3, Vector3};
use proptest::prelude::*;

fn hands(part: Part, seed: u64) -> Hands {
    let imu = Some(ImuModel::MPU_6000);
    Hands::new(&InstrumentSuite { imu, magnetometer: Some(part), ..InstrumentSuite::default() }, seed)
}

/// Returns the errors of a gyroscope that was calibrated before.
fn calibrated(hands: &Hands) -> SensorCalibration {
    let gyro_offset_rad_s = hands.instruments.imu_bias().unwrap().rates_rad_s.cast();
    SensorCalibration { gyro_offset_rad_s, ..SensorCalibration::DEFAULT }
}

/// Turns the vehicle on each side at this rate; `spoil` may change each sample.
fn turned(
    hands: &mut Hands,
    sides: &[Side],
    spin_rad_s: f64,
    spoil: impl Fn(Side, &mut RawSample),
) -> (Option<Result<FieldFit, CalibrationFailure>>, Vec<CalibrationEvent>) {
    let mut magnetometer = MagnetometerCalibration::new(&Mounting::PLAIN, &calibrated(hands));
    let (mut told, mut found) = (Vec::new(), None);
    for side in sides {
        let mut step = |sample: &RawSample| {
            let mut sample = *sample;
            spoil(*side, &mut sample);
            if found.is_none() {
                found = magnetometer.step(&sample, keep(&mut told));
            }
        };
        hands.spin_rad_s = 0.0;
        hands.turn_to(*side, [0.05, -0.05], &mut step);
        (0..40).for_each(|_| step(&hands.sample()));
        hands.spin_rad_s = spin_rad_s;
        (0..(350.0 / spin_rad_s.abs().max(0.2)) as u32).for_each(|_| step(&hands.sample()));
    }
    (found, told)
}

/// Returns the mean reading in this attitude.
fn mean(hands: &mut Hands, attitude: Rotation3<f64>) -> Vector3<f32> {
    hands.spin_rad_s = 0.0;
    hands.attitude = attitude.into();
    // Skips the sample with readings from the previous attitude.
    let _ = hands.sample();
    let fields: Vec<_> = (0..20).filter_map(|_| hands.sample().field_ut).collect();
    fields.iter().sum::<Vector3<f32>>() / fields.len() as f32
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    /// The calibration finds hard and soft iron of a vehicle full of steel, anywhere on earth. The corrected field has
    /// the same strength in every attitude, up to three times the error of 1 % that noise leaves with 144 readings. The
    /// offset equals the hard iron.
    #[test]
    fn hard_and_soft_iron_are_found(
        seed: u64, strength_ut in 25.0..65.0, inclination_rad in -1.4..1.4, hard_iron_ut in 0.0..60.0,
        soft_iron in 0.0..0.05, spin_rad_s in prop::sample::select(vec![-1.5, 0.7, 1.0, 2.0]),
        sides in Just(Side::ALL.to_vec()).prop_shuffle(),
    ) {
        let part = Part { strength_ut, inclination_rad, hard_iron_ut, soft_iron, ..Part::QMC5883L };
        let mut hands = hands(part, seed);
        let (found, told) = turned(&mut hands, &sides, spin_rad_s, |_, _| ());
        let fit = found.unwrap().unwrap();
        prop_assert_eq!(told.last(), Some(&CalibrationEvent::Progress(100)));
        let (mag_offset_ut, mag_scale, mag_off_diagonal) = (fit.offset_ut, fit.scale, fit.off_diagonal);
        let found = SensorCalibration { mag_offset_ut, mag_scale, mag_off_diagonal, ..SensorCalibration::DEFAULT };
        let attitudes = (0..20).map(f64::from).map(|it| Rotation3::from_euler_angles(it, 2.5 * it, 0.7));
        for attitude in attitudes {
            let read = mean(&mut hands, attitude);
            let off = found.field(&read).norm() / fit.strength_ut - 1.0;
            prop_assert!(off.abs() < 0.03, "{} of {}", off, fit.strength_ut);
        }
        // Opposite attitudes cancel the earth's field, which leaves the hard iron.
        let half = std::f64::consts::PI;
        let pairs = [Vector3::x(), Vector3::y(), Vector3::z()].map(|it| Rotation3::from_scaled_axis(it * half));
        let four = core::iter::once(Rotation3::identity()).chain(pairs);
        let hard_ut = four.map(|attitude| mean(&mut hands, attitude)).sum::<Vector3<f32>>() / 4.0;
        prop_assert!((hard_ut - fit.offset_ut).norm() < 0.03 * fit.strength_ut, "{} {}", hard_ut, fit.offset_ut);
    }

    /// Exact readings on any ellipsoid give offset and matrix up to rounding.
    #[test]
    fn an_ellipsoid_is_found_exactly(
        offset in prop::array::uniform3(-100.0_f32..100.0), scale in prop::array::uniform3(0.85..1.15_f64),
        off in prop::array::uniform3(-0.1..0.1_f64), strength_ut in 25.0..65.0_f64,
    ) {
        let matrix = Matrix3::new(scale[0], off[0], off[1], off[0], scale[1], off[2], off[1], off[2], scale[2]);
        let matrix = matrix / matrix.determinant().cbrt();
        let inverse = matrix.try_inverse().unwrap();
        let mut sums = FieldSums::default();
        for number in 0..200 {
            // Points of a spiral from pole to pole.
            let z = 1.0 - (f64::from(number) + 0.5) / 100.0;
            let (s, c) = (2.4 * f64::from(number)).sin_cos();
            let level = (1.0 - z * z).sqrt();
            let read = inverse * Vector3::new(level * c, level * s, z) * strength_ut + Vector3::from(offset).cast();
            sums.add(&read.cast());
        }
        let fit = sums.fit().unwrap();
        prop_assert!((fit.offset_ut - Vector3::from(offset)).norm() < 0.02, "{:?}", fit);
        prop_assert!((fit.strength_ut - strength_ut as f32).abs() < 0.02, "{:?}", fit);
        let expected = [matrix[(0, 0)], matrix[(1, 1)], matrix[(2, 2)], matrix[(0, 1)], matrix[(0, 2)], matrix[(1, 2)]];
        let found = fit.scale.iter().chain(&fit.off_diagonal);
        for (found, expected) in found.zip(expected) {
            prop_assert!((f64::from(*found) - expected).abs() < 1e-3, "{:?} {}", fit, matrix);
        }
    }

    /// For any readings, nothing panics, and a fit contains no NaN.
    #[test]
    fn nothing_spoils_a_fit(numbers in prop::collection::vec(prop::num::f32::ANY, 300), near in prop::bool::ANY) {
        let mut sums = FieldSums::default();
        for three in numbers.chunks_exact(3) {
            let all = Vector3::new(three[0], three[1], three[2]);
            sums.add(&if near { all.map(|it| it % 60.0) } else { all });
        }
        if let Ok(fit) = sums.fit() {
            prop_assert!(fit.offset_ut.iter().chain(&fit.scale).chain(&fit.off_diagonal).all(|it| it.is_finite()));
        }
    }
}

/// Readings of half a sphere, of a cone, or of one side alone are refused.
#[test]
fn too_few_directions_are_refused() {
    let spiral = |from: f32, to: f32| {
        let mut sums = FieldSums::default();
        for number in 0..200_u8 {
            let z = from + (to - from) * (f32::from(number) + 0.5) / 200.0;
            let (s, c) = (2.4 * f32::from(number)).sin_cos();
            let level = (1.0 - z * z).sqrt();
            sums.add(&(50.0 * Vector3::new(level * c, level * s, z) + Vector3::new(10.0, 20.0, -30.0)));
        }
        sums.fit()
    };
    assert!(spiral(-1.0, 1.0).is_ok());
    for (from, to) in [(0.0, 1.0), (-1.0, 0.0), (-0.5, 1.0), (0.3, 0.31), (-0.1, 0.1), (-0.3, 0.3), (0.5, 1.0)] {
        assert_eq!(spiral(from, to), Err(CalibrationFailure::TooFewDirections), "{from} to {to}");
    }
    assert_eq!(FieldSums::default().fit(), Err(CalibrationFailure::TooFewDirections));
}

#[test]
fn a_field_that_cannot_be_the_earths_is_refused() {
    for (strength_ut, expected) in
        [(10.0, Err(CalibrationFailure::FieldStrength)), (150.0, Err(CalibrationFailure::FieldStrength))]
    {
        let mut hands = hands(Part { strength_ut: f64::min(strength_ut, 100.0), ..Part::QMC5883L }, 3);
        let factor = (strength_ut / f64::min(strength_ut, 100.0)) as f32;
        let spoil = |_, sample: &mut RawSample| sample.field_ut = sample.field_ut.map(|field| factor * field);
        assert_eq!(turned(&mut hands, &Side::ALL, 1.0, spoil).0, Some(expected));
    }
    let mut hands = hands(Part::QMC5883L, 3);
    let spoil =
        |_, sample: &mut RawSample| sample.field_ut = sample.field_ut.map(|it| it + Vector3::new(0.0, 450.0, 0.0));
    assert_eq!(turned(&mut hands, &Side::ALL, 1.0, spoil).0, Some(Err(CalibrationFailure::TooLarge)));
}

/// Iron near the vehicle on some sides and not on others makes the calibration fail.
#[test]
fn an_uneven_field_is_refused() {
    let mut hands = hands(Part::QMC5883L, 3);
    let spoil = |side, sample: &mut RawSample| {
        let near = if matches!(side, Side::Back | Side::Left | Side::Down) { 15.0 } else { -15.0 };
        sample.field_ut = sample.field_ut.map(|field| field + Vector3::new(near, near, near));
    };
    assert_eq!(turned(&mut hands, &Side::ALL, 1.0, spoil).0, Some(Err(CalibrationFailure::FieldUneven)));
}

#[test]
fn what_is_left_out_is_told() {
    // Not rotated.
    let (found, told) = turned(&mut hands(Part::QMC5883L, 3), &[Side::Down, Side::Down], 0.0, |_, _| ());
    assert_eq!(found, Some(Err(CalibrationFailure::NotRotated)));
    assert_eq!(told.get(1..3), Some([CalibrationEvent::Detected(Side::Down), CalibrationEvent::Rotate].as_slice()));
    // Turning to and fro by a quarter turn never adds up to a whole turn.
    let mut quarters = hands(Part::QMC5883L, 3);
    let mut magnetometer = MagnetometerCalibration::new(&Mounting::PLAIN, &calibrated(&quarters));
    let found = (0..3000).find_map(|number| {
        quarters.spin_rad_s = if number < 40 { 0.0 } else { 1.5 * if number / 50 % 2 == 0 { 1.0 } else { -1.0 } };
        magnetometer.step(&quarters.sample(), |_| ())
    });
    assert_eq!(found, Some(Err(CalibrationFailure::NotRotated)));
    // The vehicle has no magnetometer.
    let (found, _) = turned(&mut hands(Part::QMC5883L, 3), &[Side::Down], 1.0, |_, sample| sample.field_ut = None);
    assert_eq!(found, Some(Err(CalibrationFailure::NoField)));
    // A side that is shown again is reported as repeated, and no further side follows.
    let (found, told) = turned(&mut hands(Part::QMC5883L, 3), &[Side::Up, Side::Down, Side::Up], 1.0, |_, _| ());
    assert_eq!((found, told.last()), (None, Some(&CalibrationEvent::Repeated(Side::Up))));
    let mut askew = hands(Part::QMC5883L, 3);
    askew.put(Side::Down, [0.8, 0.0]);
    let mut magnetometer = MagnetometerCalibration::new(&Mounting::PLAIN, &calibrated(&askew));
    let found = (0..5000).find_map(|_| magnetometer.step(&askew.sample(), |_| ()));
    assert_eq!(found, Some(Err(CalibrationFailure::TimedOut)));
}

/// A sensor that gives no numbers does not keep a calibration going for ever.
#[test]
fn a_sensor_without_numbers_ends_the_calibration() {
    let mut hands = hands(Part::QMC5883L, 5);
    let mut calibration = MagnetometerCalibration::new(&Mounting::PLAIN, &SensorCalibration::DEFAULT);
    let mut sample = hands.sample();
    let began_us = sample.at_us;
    sample.specific_force_m_s2.x = f32::NAN;
    let found = (0..1_000_u64).find_map(|tenth| {
        sample.at_us = began_us + 100_000 * tenth;
        calibration.step(&sample, |_| ())
    });
    assert_eq!(found.map(Result::err), Some(Some(CalibrationFailure::TimedOut)));
}

//! Tests gyroscope, accelerometer and level calibration with simulated sensors, whose errors are known.
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, missing_docs, reason = "tests")]

mod common;

use afbc_calibration::{
    AccelerometerCalibration, AccelerometerErrors, CalibrationEvent, CalibrationFailure, GyroscopeCalibration,
    LevelCalibration, RawSample, Side, Sides,
};
use afbc_plant::instruments::{AccelerometerModel as Accel, ImuModel};
use afbc_types::{Mounting, SensorCalibration};
use common::{GRAVITY, Hands, keep};
use nalgebra::{Rotation3, Vector3};
use proptest::prelude::*;

const PRESETS: [ImuModel; 3] = [ImuModel::ICM_42688_P, ImuModel::BMI270, ImuModel::MPU_6000];

fn gyroscope(
    hands: &mut Hands,
    samples: u32,
) -> (Option<Result<Vector3<f32>, CalibrationFailure>>, Vec<CalibrationEvent>) {
    let (mut gyroscope, mut told) = (GyroscopeCalibration::default(), Vec::new());
    let found = (0..samples).find_map(|_| gyroscope.step(&hands.sample(), keep(&mut told)));
    (found, told)
}

/// Measures the six sides in this order, each askew by these angles.
fn six_sides(
    hands: &mut Hands,
    mounting: &Mounting,
    sides: &[Side],
    askew_rad: impl Fn(usize) -> [f64; 2],
) -> (Option<Result<AccelerometerErrors, CalibrationFailure>>, Vec<CalibrationEvent>) {
    let (mut accelerometer, mut told, mut found) =
        (AccelerometerCalibration::new(mounting, GRAVITY as f32), Vec::new(), None);
    for (number, side) in sides.iter().enumerate() {
        let mut step = |sample: &RawSample| {
            if found.is_none() {
                found = accelerometer.step(sample, keep(&mut told));
            }
        };
        hands.turn_to(*side, askew_rad(number), &mut step);
        (0..120).for_each(|_| step(&hands.sample()));
    }
    (found, told)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// The bias of any sensor is found to five standard deviations of the error that noise, instability and random walk
    /// leave in a mean over 3 s: 0.12 mrad/s for an MPU-6000.
    #[test]
    fn a_gyroscopes_offset_is_found(preset in 0..3_usize, seed: u64) {
        let mut hands = Hands::with_imu(PRESETS[preset], seed);
        let (found, told) = gyroscope(&mut hands, 160);
        let truth = hands.instruments.imu_bias().unwrap().rates_rad_s;
        let error = (found.unwrap().unwrap().cast::<f64>() - truth).amax();
        prop_assert!(error < 6e-4, "{error}");
        let progress: Vec<_> = (1..10).map(|tenth| CalibrationEvent::Progress(10 * tenth)).collect();
        prop_assert_eq!(told, progress);
    }

    /// Offset and scale are found for a vehicle whose sides are up to 8 degrees askew in trembling hands. The remaining
    /// errors are of second order: the products of misalignment, 0.7 % of an MPU-6000, and skew.
    #[test]
    fn an_accelerometers_errors_are_found(
        preset in 0..3_usize, seed: u64, sides in Just(Side::ALL.to_vec()).prop_shuffle(),
        askew in prop::array::uniform12(-0.14..0.14), turned in 0..4_u8,
    ) {
        // A board mounted in quarter turns.
        let attitude_rad = Vector3::new(0.0, 0.0, f64::from(turned) * std::f64::consts::FRAC_PI_2);
        let mounting = Mounting { attitude_rad, position_m: Vector3::zeros() };
        let mut hands = Hands::with_imu(ImuModel { mounting, ..PRESETS[preset] }, seed);
        hands.tremor_rad = 0.004;
        let (found, told) = six_sides(&mut hands, &mounting.to_f32(), &sides, |n| [askew[2 * n], askew[2 * n + 1]]);
        let errors = found.unwrap().unwrap();
        let truth = hands.instruments.imu_bias().unwrap().specific_force_m_s2;
        let offset = (errors.offset_m_s2.cast::<f64>() - truth).amax();
        prop_assert!(offset < 0.04, "{}", offset);
        for side in &sides {
            let (detected, done) = (CalibrationEvent::Detected(*side), CalibrationEvent::Done(*side));
            prop_assert!(told.contains(&detected) && told.contains(&done));
        }
        prop_assert_eq!(told.first(), Some(&CalibrationEvent::Pending(Sides::ALL)));
        prop_assert_eq!(told.last(), Some(&CalibrationEvent::Progress(100)));
        // In any attitude the corrected reading has the size of gravity, apart from misalignment. Where all axes
        // measure the same, this is a third of the sum of its six elements, 0.053 m/s2 for an MPU-6000; the bound is
        // five times that.
        let found = SensorCalibration {
            accel_offset_m_s2: errors.offset_m_s2, accel_scale: errors.scale, ..SensorCalibration::DEFAULT
        };
        hands.tremor_rad = 0.0;
        for number in 0..40 {
            hands.attitude = Rotation3::from_euler_angles(f64::from(number), 2.0 * f64::from(number), 0.0).into();
            let mean = (0..10).map(|_| hands.sample().specific_force_m_s2).sum::<Vector3<f32>>() / 10.0;
            let error = f64::from(found.specific_force(&mean).norm()) - GRAVITY;
            prop_assert!(error.abs() < 0.27, "{} in attitude {}", error, number);
        }
    }

    /// A perfect sensor with known offset and scale, so that only arithmetic and noise matter.
    #[test]
    fn scale_and_offset_are_exact_without_misalignment(
        offset in prop::array::uniform3(-1.5_f32..1.5), scale in prop::array::uniform3(0.9_f32..1.1),
        askew in prop::array::uniform12(-0.25..0.25),
    ) {
        let (offset, scale) = (Vector3::from(offset), Vector3::from(scale));
        let mut hands = Hands::with_imu(ImuModel::DEFAULT, 1);
        let (mut accelerometer, mut found) = (AccelerometerCalibration::new(&Mounting::PLAIN, GRAVITY as f32), None);
        for (number, side) in Side::ALL.into_iter().enumerate() {
            hands.put(side, [askew[2 * number], askew[2 * number + 1]]);
            for _ in 0..120 {
                let mut sample = hands.sample();
                sample.specific_force_m_s2 = sample.specific_force_m_s2.component_div(&scale) + offset;
                if found.is_none() {
                    found = accelerometer.step(&sample, |_| ());
                }
            }
        }
        let errors = found.unwrap().unwrap();
        prop_assert!((errors.offset_m_s2 - offset).amax() < 1e-3, "{:?} {offset}", errors);
        prop_assert!((errors.scale - scale).amax() < 1e-4, "{:?} {scale}", errors);
    }

    /// Roll and pitch of the mounting are found and its yaw stays, whatever the error of the presumed mounting.
    #[test]
    fn level_is_found(
        thought in prop::array::uniform3(-1.2..1.2), off in prop::array::uniform2(-0.15..0.15), seed: u64,
    ) {
        let thought = Rotation3::from_euler_angles(thought[0], thought[1], thought[2]);
        let truth = Rotation3::from_euler_angles(off[0], off[1], 0.0) * thought;
        let angles = |it: &Rotation3<f64>| Vector3::from(<[f64; 3]>::from(it.euler_angles()));
        let mounting = |it| Mounting { attitude_rad: angles(it), position_m: Vector3::zeros() };
        let mut hands = Hands::with_imu(ImuModel { mounting: mounting(&truth), ..ImuModel::DEFAULT }, seed);
        let mut level = LevelCalibration::new(&mounting(&thought).to_f32(), &SensorCalibration::DEFAULT);
        let found = (0..120).find_map(|_| level.step(&hands.sample(), |_| ())).unwrap().unwrap();
        let found = Rotation3::from_euler_angles(found.x, found.y, found.z).cast::<f64>();
        // The measured force is vertical again, and the smallest turn led there.
        let felt = truth.inverse() * Vector3::z();
        prop_assert!((found * felt - Vector3::z()).norm() < 1e-4);
        prop_assert!((found * thought.inverse()).angle() < 1e-4 + truth.rotation_to(&thought).angle());
    }

    /// Nothing panics for any sensor values, and no result contains NaN.
    #[test]
    fn nothing_spoils_a_calibration(
        numbers in prop::collection::vec(prop::num::f32::ANY, 60), step_us in 0..3_000_000_u64,
    ) {
        let mut gyroscope = GyroscopeCalibration::default();
        let mut accelerometer = AccelerometerCalibration::new(&Mounting::PLAIN, 9.81);
        let mut level = LevelCalibration::new(&Mounting::PLAIN, &SensorCalibration::DEFAULT);
        for (number, six) in numbers.chunks_exact(6).enumerate() {
            for repeat in 0..3 {
                let sample = RawSample {
                    at_us: (3 * number as u64 + repeat) * step_us,
                    rates_rad_s: Vector3::new(six[0], six[1], six[2]),
                    specific_force_m_s2: Vector3::new(six[3], six[4], six[5]),
                    field_ut: None,
                };
                let finite = |found: Result<Vector3<f32>, _>| found.is_err() || found.is_ok_and(|it| it.norm() < 10.0);
                prop_assert!(gyroscope.step(&sample, |_| ()).is_none_or(finite));
                prop_assert!(level.step(&sample, |_| ()).is_none_or(finite));
                let _ = accelerometer.step(&sample, |_| ());
            }
        }
    }
}

/// If the vehicle is moved, the measurement starts again; without rest it fails after 20 s.
#[test]
fn a_moving_gyroscope_is_not_calibrated() {
    let mut hands = Hands::with_imu(ImuModel::ICM_42688_P, 5);
    hands.tremor_rad = 0.01;
    let (found, told) = gyroscope(&mut hands, 1100);
    assert_eq!(found, Some(Err(CalibrationFailure::Moving)));
    assert!(told.contains(&CalibrationEvent::Moved) && !told.contains(&CalibrationEvent::Progress(90)), "{told:?}");

    // The sensor is knocked after 2 s and still from then on.
    let (mut gyroscope, mut told) = (GyroscopeCalibration::default(), Vec::new());
    hands.tremor_rad = 0.0;
    for number in 0..160 {
        let mut sample = hands.sample();
        sample.rates_rad_s.x += if number == 100 { 0.1 } else { 0.0 };
        assert_eq!(gyroscope.step(&sample, keep(&mut told)), None, "{number}");
    }
    let found = (0..160).find_map(|_| gyroscope.step(&hands.sample(), keep(&mut told)));
    let truth = hands.instruments.imu_bias().unwrap().rates_rad_s;
    assert!((found.unwrap().unwrap().cast::<f64>() - truth).amax() < 6e-4);
    assert_eq!(told.iter().filter(|event| **event == CalibrationEvent::Moved).count(), 2);
}

/// At rest, the gyroscope calibration reports each tenth of its time once, and the level calibration the half.
#[test]
fn progress_is_told_at_rest() {
    let mut hands = Hands::with_imu(ImuModel::DEFAULT, 5);
    let tenths: Vec<_> = (1..10).map(|tenth| CalibrationEvent::Progress(10 * tenth)).collect();
    assert_eq!(gyroscope(&mut hands, 160).1, tenths);
    let (mut level, mut told) = (LevelCalibration::new(&Mounting::PLAIN, &SensorCalibration::DEFAULT), Vec::new());
    let mut heard_us = Vec::new();
    let began_us = hands.sample().at_us;
    let found = (0..120).find_map(|_| {
        let sample = hands.sample();
        let before = told.len();
        let found = level.step(&sample, keep(&mut told));
        heard_us.extend((told.len() > before).then_some(sample.at_us - began_us));
        found
    });
    assert!(found.unwrap().is_ok());
    assert_eq!(told, [CalibrationEvent::Progress(50)]);
    assert!((950_000..1_100_000).contains(&heard_us[0]), "{heard_us:?}");
}

/// If the vehicle moves, the level calibration reports it and starts again; without rest it fails after 20 s, not
/// before.
#[test]
fn a_moving_vehicle_has_no_level() {
    let mut hands = Hands::with_imu(ImuModel::ICM_42688_P, 5);
    hands.tremor_rad = 0.05;
    let (mut level, mut told) = (LevelCalibration::new(&Mounting::PLAIN, &SensorCalibration::DEFAULT), Vec::new());
    let began_us = hands.sample().at_us;
    let mut at_us = 0;
    let found = (0..1_200).find_map(|_| {
        let sample = hands.sample();
        at_us = sample.at_us - began_us;
        level.step(&sample, keep(&mut told))
    });
    assert_eq!(found, Some(Err(CalibrationFailure::Moving)));
    assert!((19_900_000..20_200_000).contains(&at_us), "{at_us}");
    assert!(told.contains(&CalibrationEvent::Moved) && !told.contains(&CalibrationEvent::Progress(50)), "{told:?}");
}

/// A sample that is no number is left out of every calibration: it shows no motion, and the rest goes on.
#[test]
fn a_sample_that_is_no_number_shows_no_motion() {
    // Returns whether the calibration has succeeded after these samples, and what it has told.
    type Calibrate = fn(&[RawSample]) -> (bool, Vec<CalibrationEvent>);
    let calibrations: [Calibrate; 3] = [
        |samples| {
            let (mut calibration, mut told) = (GyroscopeCalibration::default(), Vec::new());
            let found = samples.iter().find_map(|sample| calibration.step(sample, keep(&mut told)));
            (found.is_some_and(|found| found.is_ok()), told)
        },
        |samples| {
            let level = LevelCalibration::new(&Mounting::PLAIN, &SensorCalibration::DEFAULT);
            let (mut calibration, mut told) = (level, Vec::new());
            let found = samples.iter().find_map(|sample| calibration.step(sample, keep(&mut told)));
            (found.is_some_and(|found| found.is_ok()), told)
        },
        |samples| {
            let accelerometer = AccelerometerCalibration::new(&Mounting::PLAIN, GRAVITY as f32);
            let (mut calibration, mut told) = (accelerometer, Vec::new());
            assert!(samples.iter().all(|sample| calibration.step(sample, keep(&mut told)).is_none()));
            (told.iter().any(|event| matches!(event, CalibrationEvent::Done(_))), told)
        },
    ];
    let mut hands = Hands::with_imu(ImuModel::DEFAULT, 5);
    // The first sample is a mean of fewer readings, and differs.
    hands.sample();
    let samples: Vec<_> = (0..200).map(|_| hands.sample()).collect();
    for calibrate in calibrations {
        let sound = calibrate(&samples);
        assert!(sound.0 && !sound.1.contains(&CalibrationEvent::Moved), "{sound:?}");
        for (number, axis) in [(0, 0), (1, 1), (50, 2), (80, 3), (99, 4)] {
            let mut broken = samples.clone();
            let RawSample { rates_rad_s, specific_force_m_s2, .. } = &mut broken[number];
            let numbers = rates_rad_s.iter_mut().chain(specific_force_m_s2);
            *numbers.into_iter().nth(axis).unwrap() = if axis % 2 == 0 { f32::NAN } else { f32::INFINITY };
            assert_eq!(calibrate(&broken), sound, "sample {number}, number {axis}");
        }
    }
}

#[test]
fn a_gyroscope_with_too_large_an_offset_is_broken() {
    let mut hands = Hands::with_imu(ImuModel::DEFAULT, 5);
    hands.spin_rad_s = 0.9;
    assert_eq!(gyroscope(&mut hands, 160).0, Some(Err(CalibrationFailure::TooLarge)));
}

#[test]
fn a_tilted_vehicle_is_not_level() {
    for (tilt_rad, fails) in [(0.25_f64, false), (0.28, true), (3.0, true)] {
        let mut hands = Hands::with_imu(ImuModel::DEFAULT, 5);
        hands.put(Side::Down, [tilt_rad, 0.0]);
        let mut level = LevelCalibration::new(&Mounting::PLAIN, &SensorCalibration::DEFAULT);
        let found = (0..120).find_map(|_| level.step(&hands.sample(), |_| ())).unwrap();
        assert_eq!(found == Err(CalibrationFailure::NotLevel), fails, "{tilt_rad}");
    }
}

/// The calibrated errors of the accelerometer are used, so that they do not become a tilt.
#[test]
fn level_knows_the_accelerometers_errors() {
    let accel = Accel { bias_m_s2: 0.5, ..Accel::DEFAULT };
    let mut hands = Hands::with_imu(ImuModel { accel, ..ImuModel::DEFAULT }, 7);
    let accel_offset_m_s2 = hands.instruments.imu_bias().unwrap().specific_force_m_s2.cast();
    let tilt = |errors: &SensorCalibration, hands: &mut Hands| {
        let mut level = LevelCalibration::new(&Mounting::PLAIN, errors);
        (0..120).find_map(|_| level.step(&hands.sample(), |_| ())).unwrap().unwrap().xy().norm()
    };
    let errors = SensorCalibration { accel_offset_m_s2, ..SensorCalibration::DEFAULT };
    assert!(tilt(&errors, &mut hands) < 1e-4);
    assert!(tilt(&SensorCalibration::DEFAULT, &mut hands) > 1e-2);
}

/// Reports a repeated side, a vehicle between sides, a vehicle moved during a measurement, and a timeout.
#[test]
fn what_an_operator_does_wrong_is_told() {
    let mut hands = Hands::with_imu(ImuModel::ICM_42688_P, 3);
    let at = |_| [0.0; 2];
    let (found, told) = six_sides(&mut hands, &Mounting::PLAIN, &[Side::Left, Side::Down, Side::Left], at);
    assert_eq!((found, told.last()), (None, Some(&CalibrationEvent::Repeated(Side::Left))));
    assert_eq!(told.iter().filter(|event| **event == CalibrationEvent::Done(Side::Left)).count(), 1);

    let (_, told) = six_sides(&mut hands, &Mounting::PLAIN, &[Side::Down], |_| [0.8, 0.0]);
    assert_eq!(told, [CalibrationEvent::Pending(Sides::ALL), CalibrationEvent::Askew]);

    // The vehicle is put down elsewhere a second after the side was detected.
    let (mut accelerometer, mut told) = (AccelerometerCalibration::new(&Mounting::PLAIN, GRAVITY as f32), Vec::new());
    hands.put(Side::Up, [0.0; 2]);
    (0..60).for_each(|_| assert_eq!(accelerometer.step(&hands.sample(), keep(&mut told)), None));
    hands.turn_to(Side::Front, [0.0; 2], |sample| assert_eq!(accelerometer.step(sample, keep(&mut told)), None));
    assert_eq!(
        told,
        [CalibrationEvent::Pending(Sides::ALL), CalibrationEvent::Detected(Side::Up), CalibrationEvent::Moved]
    );

    let (mut accelerometer, mut told) = (AccelerometerCalibration::new(&Mounting::PLAIN, GRAVITY as f32), Vec::new());
    hands.put(Side::Down, [0.8, 0.0]);
    let failed = (0..5000).find_map(|_| accelerometer.step(&hands.sample(), keep(&mut told)));
    assert_eq!(failed, Some(Err(CalibrationFailure::TimedOut)));
}

/// On a board turned by 45 degrees, the six sides cannot separate its axes x and y.
#[test]
fn a_board_between_the_axes_is_refused() {
    let mounting = Mounting { attitude_rad: Vector3::new(0.0, 0.0, 0.785), position_m: Vector3::zeros() };
    let mut hands = Hands::with_imu(ImuModel { mounting, ..ImuModel::ICM_42688_P }, 3);
    let (found, _) = six_sides(&mut hands, &mounting.to_f32(), &Side::ALL, |_| [0.0; 2]);
    assert_eq!(found, Some(Err(CalibrationFailure::TooFewDirections)));
}

#[test]
fn a_broken_accelerometer_is_refused() {
    let accel = Accel { bias_m_s2: 2.0, ..Accel::DEFAULT };
    let refused = (0..20).filter(|seed| {
        let mut hands = Hands::with_imu(ImuModel { accel, ..ImuModel::DEFAULT }, *seed);
        let bias = hands.instruments.imu_bias().unwrap().specific_force_m_s2.amax();
        let (found, _) = six_sides(&mut hands, &Mounting::PLAIN, &Side::ALL, |_| [0.0; 2]);
        assert!(bias < 2.0 || !matches!(found, Some(Ok(_))), "{bias}: {found:?}");
        matches!(found, Some(Err(CalibrationFailure::TooLarge)))
    });
    assert!(refused.count() > 3);
}

/// Sides have PX4's names: the side that is down.
#[test]
fn sides_are_named_by_what_is_down() {
    // Attitudes by roll and pitch, right-handed about forward and left. Nose down means that the nose's axis points
    // down.
    let quarter = std::f64::consts::FRAC_PI_2;
    let expected = [
        (Side::Down, [0.0, 0.0]),
        (Side::Up, [2.0 * quarter, 0.0]),
        (Side::Front, [0.0, quarter]),
        (Side::Back, [0.0, -quarter]),
        // Rolled to the right, the right side is down.
        (Side::Right, [quarter, 0.0]),
        (Side::Left, [-quarter, 0.0]),
    ];
    for (side, [roll, pitch]) in expected {
        let body_to_earth = Rotation3::from_euler_angles(roll, pitch, 0.0);
        let felt = body_to_earth.inverse() * Vector3::new(0.0, 0.0, GRAVITY);
        assert_eq!(Side::of(&felt.cast()), Some(side));
        assert_eq!(Side::of(&(1.5 * felt).cast()), None, "not at rest");
    }
    assert_eq!(Side::of(&Vector3::new(7.0, 0.0, 7.0)), None);
    assert_eq!(Side::of(&Vector3::repeat(f32::NAN)), None);
}

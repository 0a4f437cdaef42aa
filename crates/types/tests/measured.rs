//! Tests of measurements: poses and their uncertainty, sensor corrections, ages and ranges.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs)] // tests

use afbc_types::{Pose, PoseSigmas, Range, SensorCalibration, Setpoint, Stamped, State};
use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;

fn vector(most: f32) -> impl Strategy<Value = Vector3<f32>> {
    prop::array::uniform3(-most..most).prop_map(Vector3::from)
}

/// A number that may be invalid as a standard deviation or a variance.
fn number() -> impl Strategy<Value = f32> {
    let edges = [0.0, -0.0, f32::NAN, f32::INFINITY, -1.0, f32::MIN_POSITIVE, f32::MAX];
    prop_oneof![3 => 0.0_f32..4.0, 1 => prop::sample::select(edges.to_vec())]
}

proptest! {
    /// A pose is plausible if its position, its rotation and its known standard deviations are.
    #[test]
    fn a_pose_is_plausible_by_each_of_its_parts(
        place in 0..3_usize,
        far_m in prop_oneof![5 => -1e5_f32..=1e5, 1 => Just(1e5_f32.next_up()), 1 => Just(f32::NAN), 1 => Just(-2e5)],
        turned in vector(3.0),
        scale in prop_oneof![5 => Just(1.0_f32), 2 => 0.8_f32..1.2, 1 => Just(f32::NAN)],
        sigmas in [prop::option::of(number()), prop::option::of(number())],
    ) {
        let mut state = State { attitude_rad: turned, ..State::default() };
        state.position_m[place] = far_m;
        let [position_m, attitude_rad] = sigmas;
        let sigmas = PoseSigmas { position_m, attitude_rad };
        let mut pose = Pose::of(&state, sigmas);
        // The pose has the same rotation as the state, and keeps the standard deviations.
        let [w, x, y, z] = pose.attitude;
        let same = State::from_quaternion(Vector3::zeros(), Vector3::zeros(), &nalgebra::Quaternion::new(w, x, y, z),
            Vector3::zeros()).unwrap();
        prop_assert!((same.quaternion().to_rotation_matrix().matrix()
            - state.quaternion().to_rotation_matrix().matrix()).amax() < 1e-5);
        prop_assert_eq!(pose.sigmas.position_m.map(f32::to_bits), position_m.map(f32::to_bits));
        pose.attitude = pose.attitude.map(|part| part * scale);
        let known = |sigma: Option<f32>| sigma.is_none_or(|sigma| sigma.is_finite() && sigma > 0.0);
        let squared = f64::from(scale) * f64::from(scale);
        // Skip values at the bounds, where rounding decides.
        prop_assume!([0.9, 1.1].iter().all(|bound| (squared - bound).abs() >= 1e-5));
        let wanted = far_m.abs() <= 1e5
            && (squared - 1.0).abs() <= 0.1
            && known(position_m)
            && known(attitude_rad);
        prop_assert_eq!(pose.is_plausible(), wanted);
    }

    /// The standard deviation is the root of the largest variance, if all are possible and one is positive.
    #[test]
    fn the_largest_variance_counts(
        position in prop::array::uniform3(number()), attitude in prop::array::uniform3(number()),
    ) {
        let sigmas = PoseSigmas::from_variances(position, attitude);
        for (sigma, variances) in [(sigmas.position_m, position), (sigmas.attitude_rad, attitude)] {
            let possible = variances.iter().all(|variance| variance.is_finite() && *variance >= 0.0);
            let largest = variances.iter().copied().map(f64::from).fold(0.0, f64::max);
            match sigma {
                Some(sigma) => {
                    prop_assert!(possible && largest > 0.0, "{variances:?}");
                    let sigma = f64::from(sigma);
                    prop_assert!((sigma * sigma - largest).abs() <= 3e-7 * largest, "{sigma} of {largest}");
                }
                None => prop_assert!(!possible || largest == 0.0, "{variances:?}"),
            }
        }
    }

    /// The calibration restores the true value from a reading with its errors.
    #[test]
    fn a_correction_takes_the_error_back(
        truth in vector(60.0),
        offsets in (vector(5.0), vector(1000.0)),
        accel_scale in prop::array::uniform3(0.8_f32..1.25),
        mag_scale in prop::array::uniform3(0.5_f32..2.0),
        mag_off_diagonal in vector(0.2),
    ) {
        let (accel_offset_m_s2, mag_offset_ut) = offsets;
        let calibration = SensorCalibration {
            accel_offset_m_s2,
            mag_offset_ut,
            accel_scale: accel_scale.into(),
            mag_scale: mag_scale.into(),
            mag_off_diagonal,
            ..SensorCalibration::DEFAULT
        };
        let read = truth.component_div(&calibration.accel_scale) + accel_offset_m_s2;
        prop_assert!((calibration.specific_force(&read) - truth).amax() < 1e-4);
        let ([sx, sy, sz], [xy, xz, yz]) = (mag_scale, mag_off_diagonal.into());
        let matrix = Matrix3::new(sx, xy, xz, xy, sy, yz, xz, yz, sz).cast::<f64>();
        prop_assume!(matrix.determinant().abs() > 0.01);
        let read = matrix.try_inverse().unwrap() * truth.cast() + mag_offset_ut.cast();
        let off = (calibration.field(&read.cast()).cast() - truth.cast::<f64>()).amax();
        // Readings of some thousands are rounded.
        prop_assert!(off < 1e-6 * (read.amax() + 1_000.0) * 6.0, "{off}");
    }

    /// The inertial sensor counts as uncorrected only if nothing of it is corrected.
    #[test]
    fn any_correction_of_the_inertial_sensor_shows(place in 0..9_usize, by in 1e-6_f32..0.1) {
        let mut calibration = SensorCalibration { mag_offset_ut: Vector3::repeat(by), ..SensorCalibration::DEFAULT };
        prop_assert!(calibration.leaves_imu());
        let SensorCalibration { gyro_offset_rad_s: gyro, accel_offset_m_s2: accel, accel_scale: scale, .. } =
            &mut calibration;
        [gyro, accel, scale][place / 3][place % 3] += by;
        prop_assert!(!calibration.leaves_imu());
    }

    /// The age is the elapsed time, at most `u32::MAX`. A future stamp has the age `u32::MAX`.
    #[test]
    fn an_age_is_the_time_since(at_us: u64, since_us in prop_oneof![any::<u64>(), 0..10_000_000_000_u64]) {
        let stamped = Stamped { value: (), at_us };
        match at_us.checked_add(since_us) {
            Some(now_us) => prop_assert_eq!(u64::from(stamped.age_us(now_us)), since_us.min(u32::MAX.into())),
            None => prop_assert_eq!(stamped.age_us(at_us.saturating_sub(since_us.max(1))), u32::MAX),
        }
        prop_assert_eq!(stamped.age_us(at_us), 0);
        if at_us > 0 {
            prop_assert_eq!(stamped.age_us(at_us - 1), u32::MAX);
        }
    }

    /// A setpoint that holds a state has the state's position and heading, and is at rest.
    #[test]
    fn holding_is_at_rest(
        position_m in vector(1e3), velocity_m_s in vector(1e3), attitude_rad in vector(3.0), rates_rad_s in vector(1e3),
    ) {
        let held = Setpoint::hold(&State { position_m, velocity_m_s, attitude_rad, rates_rad_s });
        prop_assert_eq!(held, Setpoint { position_m, yaw_rad: attitude_rad.z, ..Setpoint::default() });
    }

    /// A range accepts values within it, ends included, and names a value that it refuses.
    #[test]
    fn a_range_names_what_it_refuses(ends in [-1e3_f32..1e3, -1e3_f32..1e3], value in -2e3_f64..2e3, at in 0..4_u8) {
        let (min, max) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        let [least, most] = [min, max].map(f64::from);
        let range = Range::over("height_m", least..=most);
        prop_assert_eq!(range, Range::new("height_m", least, most));
        let value = match at {
            0 => value,
            1 => least,
            2 => most,
            _ => f64::NAN,
        };
        match range.check(value) {
            Ok(()) => prop_assert!((min..=max).contains(&(value as f32))),
            Err(error) => {
                prop_assert!(!(min..=max).contains(&(value as f32)));
                let told = format!("height_m = {value} is out of range: it must lie within {least} to {most}");
                prop_assert_eq!(error.to_string(), told);
            }
        }
    }
}

#[test]
fn a_pose_is_level_at_first() {
    assert_eq!(Pose::default(), Pose::of(&State::default(), PoseSigmas::UNKNOWN));
    assert!(Pose::default().is_plausible());
}

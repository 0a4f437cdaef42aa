//! Converts raw IMU samples to those of an error-free IMU at the centre of mass, aligned with the body axes.

use crate::measurement::ImuSample;
use afbc_types::{Mounting, SensorCalibration};
use nalgebra::{Matrix3, Vector3};

/// Longest gap between two samples from which an angular acceleration is computed \[us\]. After a longer gap the lever
/// arm's term d omega/dt x r is left out.
const LEVER_GAP_US: u64 = 10_000;

/// Corrects the samples of a mounted IMU. With R from sensor to body axes and the sensor at r,
///
/// ```text
/// omega = R omega_s,   f = R f_s - d omega/dt x r - omega x (omega x r)
/// ```
///
/// where d omega/dt is the difference from the last sample, and omega_s and f_s are the raw readings without their
/// [calibrated](SensorCalibration) errors. The default is a sensor without errors at the centre of mass, aligned with
/// the body axes: it returns every sample unchanged, bit by bit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ImuCalibration(Option<MountedImu>);

#[derive(Clone, Copy, Debug, PartialEq)]
struct MountedImu {
    /// Rotation R from sensor to body axes.
    to_body: Matrix3<f32>,
    /// Position r of the sensor \[m\].
    position_m: Vector3<f32>,
    gyro_offset_rad_s: Vector3<f32>,
    accel_offset_m_s2: Vector3<f32>,
    accel_scale: Vector3<f32>,
}

impl ImuCalibration {
    /// Creates the correction for an error-free sensor with this mounting. The mounting must be
    /// [valid](afbc_types::Declared::validate).
    #[must_use]
    pub fn new(mounting: &Mounting) -> Self {
        Self::calibrated(mounting, &SensorCalibration::DEFAULT)
    }

    /// Creates the correction for a sensor with this mounting and these errors.
    #[must_use]
    pub fn calibrated(mounting: &Mounting, errors: &SensorCalibration) -> Self {
        let SensorCalibration { gyro_offset_rad_s, accel_offset_m_s2, accel_scale, .. } = *errors;
        ImuCalibration((!mounting.is_plain() || !errors.leaves_imu()).then(|| MountedImu {
            to_body: mounting.r_body_sensor(),
            position_m: mounting.position_m,
            gyro_offset_rad_s,
            accel_offset_m_s2,
            accel_scale,
        }))
    }

    /// Returns the rotation from the sensor axes to the body axes.
    #[must_use]
    pub fn to_body(&self) -> Matrix3<f32> {
        self.0.as_ref().map_or_else(Matrix3::identity, |mounted| mounted.to_body)
    }

    /// Returns the sample of a sensor at the centre of mass. `last` keeps the previous corrected sample; it is `None`
    /// at first.
    // Only the check is inlined: a sensor without mounting and errors costs no more than that.
    #[inline(always)]
    pub fn apply(&self, last: &mut Option<ImuSample>, sample: ImuSample) -> ImuSample {
        self.0.as_ref().map_or(sample, |mounted| mounted.apply(last, sample))
    }
}

impl MountedImu {
    #[inline(never)]
    fn apply(&self, last: &mut Option<ImuSample>, sample: ImuSample) -> ImuSample {
        let MountedImu { to_body, position_m: r, gyro_offset_rad_s, accel_offset_m_s2, accel_scale } = self;
        // The errors are along the sensor's own axes, so they are subtracted before the rotation.
        let rates_rad_s = to_body * (sample.rates_rad_s - gyro_offset_rad_s);
        let felt_m_s2 = (sample.specific_force_m_s2 - accel_offset_m_s2).component_mul(accel_scale);
        let since = last.map(|before| (sample.at_us.saturating_sub(before.at_us), rates_rad_s - before.rates_rad_s));
        let acceleration_rad_s2 = match since {
            // 0 also stands for a time that goes back. Both leave nothing to divide by.
            Some((us @ 1..=LEVER_GAP_US, change_rad_s)) => change_rad_s * (1e6 / us as f32),
            _ => Vector3::zeros(),
        };
        let lever_m_s2 = acceleration_rad_s2.cross(r) + rates_rad_s.cross(&rates_rad_s.cross(r));
        let specific_force_m_s2 = to_body * felt_m_s2 - lever_m_s2;
        let corrected = ImuSample { at_us: sample.at_us, rates_rad_s, specific_force_m_s2 };
        // A sample with NaN does not become `last`, so it cannot spoil the next sample.
        *last = Some(corrected).filter(|_| rates_rad_s.norm_squared().is_finite());
        corrected
    }
}

#[cfg(test)]
mod tests {
    use super::ImuCalibration;
    use crate::measurement::ImuSample;
    use afbc_types::{Mounting, SensorCalibration};
    use nalgebra::{Rotation3, Vector3};
    use proptest::prelude::*;

    fn vector(most: f32) -> impl Strategy<Value = Vector3<f32>> {
        prop::array::uniform3(-most..most).prop_map(Vector3::from)
    }

    proptest! {
        /// The correction recovers the rates and force at the centre of mass for any mounting and motion.
        #[test]
        fn a_sensor_anywhere_is_as_one_at_the_centre(
            position_m in vector(0.3), attitude_rad in vector(3.0), omega in vector(8.0), force in vector(20.0),
            change in vector(50.0), at_us in 1_000_u64..1_000_000_000, step_us in 200_u64..9_000,
        ) {
            let mounting = Mounting { position_m, attitude_rad };
            let to_body = Rotation3::from_euler_angles(attitude_rad.x, attitude_rad.y, attitude_rad.z);
            let (calibration, mut last) = (ImuCalibration::new(&mounting), None);
            let before = omega - change * (step_us as f32 * 1e-6);
            let felt = |omega: Vector3<f32>, at_us: u64| {
                let lever = change.cross(&position_m) + omega.cross(&omega.cross(&position_m));
                ImuSample { at_us, rates_rad_s: to_body.inverse() * omega,
                    specific_force_m_s2: to_body.inverse() * (force + lever) }
            };
            let _ = calibration.apply(&mut last, felt(before, at_us));
            let sample = calibration.apply(&mut last, felt(omega, at_us + step_us));
            prop_assert!((sample.rates_rad_s - omega).norm() < 1e-4);
            prop_assert!((sample.specific_force_m_s2 - force).norm() < 2e-2, "{}", sample.specific_force_m_s2 - force);
            prop_assert_eq!(sample.at_us, at_us + step_us);
        }
    }

    proptest! {
        /// Errors along the sensor's own axes are removed before the rotation of the mounting.
        #[test]
        fn errors_are_taken_back_in_the_sensors_axes(
            attitude_rad in vector(3.0), omega in vector(8.0), force in vector(20.0), gyro_offset_rad_s in vector(0.5),
            accel_offset_m_s2 in vector(3.0), change in vector(0.15),
        ) {
            let accel_scale = Vector3::repeat(1.0) + change;
            let errors = SensorCalibration {
                gyro_offset_rad_s, accel_offset_m_s2, accel_scale, ..SensorCalibration::DEFAULT
            };
            let mounting = Mounting { attitude_rad, ..Mounting::PLAIN };
            let to_body = Rotation3::from_euler_angles(attitude_rad.x, attitude_rad.y, attitude_rad.z);
            let read = ImuSample {
                at_us: 1,
                rates_rad_s: to_body.inverse() * omega + gyro_offset_rad_s,
                specific_force_m_s2: (to_body.inverse() * force).component_div(&accel_scale) + accel_offset_m_s2,
            };
            let sample = ImuCalibration::calibrated(&mounting, &errors).apply(&mut None, read);
            prop_assert!((sample.rates_rad_s - omega).norm() < 1e-4);
            prop_assert!((sample.specific_force_m_s2 - force).norm() < 1e-4);
        }
    }

    #[test]
    fn a_sample_that_is_no_number_spoils_no_other() {
        let mounting = Mounting { position_m: Vector3::new(0.1, 0.2, 0.0), ..Mounting::PLAIN };
        let at = |at_us| ImuSample { at_us, rates_rad_s: Vector3::repeat(1.0), ..ImuSample::default() };
        for odd in [f32::NAN, f32::INFINITY, f32::MAX] {
            let (calibration, mut last) = (ImuCalibration::new(&mounting), None);
            let _ = calibration.apply(&mut last, at(1_000));
            let _ = calibration.apply(&mut last, ImuSample { rates_rad_s: Vector3::new(0.0, odd, 0.0), ..at(2_000) });
            let next = calibration.apply(&mut last, at(3_000));
            assert!(next.specific_force_m_s2.norm() < 1.0, "{odd}: {}", next.specific_force_m_s2);
        }
    }

    #[test]
    fn a_plain_mounting_changes_no_bit_and_a_gap_tells_no_acceleration() {
        let odd = ImuSample {
            at_us: 7,
            rates_rad_s: Vector3::new(f32::NAN, 1e-40, -0.0),
            specific_force_m_s2: Vector3::new(1.0, f32::INFINITY, 9.81),
        };
        let plain = ImuCalibration::new(&Mounting::PLAIN).apply(&mut None, odd);
        assert_eq!(plain.rates_rad_s.map(f32::to_bits), odd.rates_rad_s.map(f32::to_bits));
        assert_eq!(plain.specific_force_m_s2.map(f32::to_bits), odd.specific_force_m_s2.map(f32::to_bits));

        let mounting = Mounting { position_m: Vector3::new(0.1, 0.0, 0.0), ..Mounting::PLAIN };
        let (calibration, mut last) = (ImuCalibration::new(&mounting), None);
        let turning = |at_us, z| ImuSample { at_us, rates_rad_s: Vector3::new(0.0, 0.0, z), ..ImuSample::default() };
        for at_us in [1_000, 11_001, 11_001, 5_000] {
            let rate = at_us as f32 * 1e-4;
            let force = calibration.apply(&mut last, turning(at_us, rate)).specific_force_m_s2;
            assert!((force - Vector3::new(0.1 * rate * rate, 0.0, 0.0)).norm() < 1e-6, "{at_us}: {force}");
        }
    }
}

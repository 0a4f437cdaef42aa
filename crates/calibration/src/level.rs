//! Calibration of roll and pitch of the IMU's mounting.

use crate::rest::{RestLimits, RestSamples};
use crate::{CalibrationEvent, CalibrationFailure, RawSample};
use afbc_types::{Mounting, SensorCalibration, euler_angles};
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};

/// Time at rest over which the mean is taken \[us\].
const MEASURE_US: u64 = 2_000_000;
/// Time allowed for the whole measurement \[us\].
const PATIENCE_US: u64 = 20_000_000;
/// Largest tilt that counts as level \[rad\]: 15 degrees. A sensor with a very different mounting needs the mounting
/// set as a parameter first.
const TILT_MAX_RAD: f32 = 0.262;

/// Measures the tilt of the IMU in a vehicle that stands level. The IMU's yaw in the vehicle cannot be measured at
/// rest, and stays as it is.
#[derive(Clone, Debug)]
pub struct LevelCalibration {
    mounting: Mounting,
    errors: SensorCalibration,
    began_us: Option<u64>,
    rest: RestSamples,
    told: bool,
}

impl LevelCalibration {
    /// Creates the calibration for a sensor with this presumed mounting and these errors.
    #[must_use]
    pub fn new(mounting: &Mounting, errors: &SensorCalibration) -> Self {
        LevelCalibration {
            mounting: *mounting,
            errors: *errors,
            began_us: None,
            rest: RestSamples::default(),
            told: false,
        }
    }

    /// Takes a sample. Returns roll, pitch and yaw of the mounting \[rad\], or the failure, at the end.
    pub fn step(
        &mut self,
        sample: &RawSample,
        mut tell: impl FnMut(CalibrationEvent),
    ) -> Option<Result<Vector3<f32>, CalibrationFailure>> {
        let began_us = *self.began_us.get_or_insert(sample.at_us);
        // A sample that is no number is left out, as if it had not arrived.
        if sample.is_finite() && !self.rest.add(sample, &RestLimits::STANDING) {
            tell(CalibrationEvent::Moved);
        }
        if self.rest.elapsed_us() >= MEASURE_US {
            return Some(self.attitude().ok_or(CalibrationFailure::NotLevel));
        }
        if self.rest.elapsed_us() >= MEASURE_US / 2 && !self.told {
            self.told = true;
            tell(CalibrationEvent::Progress(50));
        }
        (sample.at_us.saturating_sub(began_us) >= PATIENCE_US).then_some(Err(CalibrationFailure::Moving))
    }

    /// Returns the mounting with which the measured force is vertical: C R, where C is the smallest rotation that turns
    /// the mean force, measured with R, to body z.
    fn attitude(&self) -> Option<Vector3<f32>> {
        let r: Matrix3<f32> = self.mounting.r_body_sensor();
        let up = r * self.errors.specific_force(&self.rest.specific_force_m_s2());
        if up.angle(&Vector3::z()) > TILT_MAX_RAD {
            return None;
        }
        let c = UnitQuaternion::rotation_between(&up, &Vector3::z())?;
        let turned: Quaternion<f32> =
            (c * UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(r))).into_inner();
        Some(euler_angles(&turned, libm::atan2f, libm::sqrtf)).filter(|angles| angles.iter().all(|it| it.is_finite()))
    }
}

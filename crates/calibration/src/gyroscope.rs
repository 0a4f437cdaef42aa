//! Calibration of the gyroscope's offset.

use crate::rest::{RestLimits, RestSamples};
use crate::{CalibrationEvent, CalibrationFailure, RawSample};
use nalgebra::Vector3;

/// Time at rest over which the mean is taken \[us\].
const MEASURE_US: u64 = 3_000_000;
/// Time allowed for the whole measurement \[us\].
const PATIENCE_US: u64 = 20_000_000;
/// Largest offset: more than twice that of an MPU-6000, 20 deg/s \[rad/s\].
const OFFSET_MAX_RAD_S: f32 = 0.8;
/// Step of the reported progress \[%\].
const STEP: u8 = 10;

/// Measures the gyroscope's offset, the mean of its rates while the vehicle stands still. A steady turn about the
/// vertical cannot be distinguished from an offset.
#[derive(Clone, Debug, Default)]
pub struct GyroscopeCalibration {
    began_us: Option<u64>,
    rest: RestSamples,
    told: u8,
}

impl GyroscopeCalibration {
    /// Takes a sample. Returns the offset in sensor axes \[rad/s\], or the failure, at the end.
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
            let offset = self.rest.rates_rad_s();
            return Some(if offset.amax() <= OFFSET_MAX_RAD_S {
                Ok(offset)
            } else {
                Err(CalibrationFailure::TooLarge)
            });
        }
        // Below 100, because a rest that is long enough has returned above.
        let share = (100 * self.rest.elapsed_us() / MEASURE_US) as u8 / STEP * STEP;
        if share > self.told {
            self.told = share;
            tell(CalibrationEvent::Progress(share));
        }
        (sample.at_us.saturating_sub(began_us) >= PATIENCE_US).then_some(Err(CalibrationFailure::Moving))
    }
}

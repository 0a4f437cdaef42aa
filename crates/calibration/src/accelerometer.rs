//! Calibration of the accelerometer's offset and scale.

use crate::rest::{RestLimits, RestSamples};
use crate::side::{Side, Sides};
use crate::{CalibrationEvent, CalibrationFailure, RawSample};
use afbc_types::Mounting;
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

/// Time at rest after which the side is detected, and time over which its mean is taken \[us\].
const DETECT_US: u64 = 500_000;
const MEASURE_US: u64 = 2_000_000;
/// Time allowed for the next side \[us\].
const PATIENCE_US: u64 = 90_000_000;
/// Smallest part of gravity that some side must have along each sensor axis, in both directions, about the mean of all
/// sides.
const ALONG_MIN: f32 = 0.75;
/// Largest offset: twice that of an MPU-6000, 80 mg \[m/s2\]. Largest scale error: four times that of an MPU-6000, 3 %.
const OFFSET_MAX_M_S2: f32 = 2.0;
const SCALE_ERROR_MAX: f32 = 0.12;
/// Largest number of Newton steps, each of which doubles the correct digits, and the change that ends them.
const STEPS: u8 = 12;
const PRECISION: f32 = 1e-5;

/// Errors of an accelerometer, as in [`SensorCalibration`](afbc_types::SensorCalibration).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AccelerometerErrors {
    /// Offset, sensor axes \[m/s2\].
    pub offset_m_s2: Vector3<f32>,
    /// Factors on the readings minus the offset, sensor axes.
    pub scale: Vector3<f32>,
}

/// Measures the accelerometer's errors o and S = diag(s) from the specific forces f at rest on the six sides: with the
/// right errors, all corrected forces have the size of gravity,
///
/// ```text
/// |S (f - o)| = g
/// ```
///
/// A side need not point straight down, so a vehicle may be held by hand. The sensor's axes must be near the body's
/// axes, in any order.
#[derive(Clone, Debug)]
pub struct AccelerometerCalibration {
    to_body: Matrix3<f32>,
    gravity_m_s2: f32,
    /// Time at which the last side was finished \[us\].
    done_us: Option<u64>,
    rest: RestSamples,
    /// Side that points to the ground during the present rest, once detected; true if that side is finished.
    detected: Option<(Option<Side>, bool)>,
    pending: Sides,
    read_m_s2: Matrix3x6,
}

/// Specific force on each side.
type Matrix3x6 = nalgebra::SMatrix<f32, 3, 6>;

impl AccelerometerCalibration {
    /// Creates the calibration for a sensor with this mounting and this gravity \[m/s2\].
    #[must_use]
    pub fn new(mounting: &Mounting, gravity_m_s2: f32) -> Self {
        AccelerometerCalibration {
            to_body: mounting.r_body_sensor(),
            gravity_m_s2,
            done_us: None,
            rest: RestSamples::default(),
            detected: None,
            pending: Sides::ALL,
            read_m_s2: Matrix3x6::zeros(),
        }
    }

    /// Takes a sample. Returns the errors, or the failure, at the end.
    pub fn step(
        &mut self,
        sample: &RawSample,
        mut tell: impl FnMut(CalibrationEvent),
    ) -> Option<Result<AccelerometerErrors, CalibrationFailure>> {
        let done_us = *self.done_us.get_or_insert_with(|| {
            tell(CalibrationEvent::Pending(Sides::ALL));
            sample.at_us
        });
        // A sample that is no number is left out, as if it had not arrived.
        let rests = !sample.is_finite() || self.rest.add(sample, &RestLimits::HELD);
        // Between two sides the vehicle is to be moved, so motion is reported only during a measurement.
        if !rests && matches!(self.detected.take(), Some((Some(_), false))) {
            tell(CalibrationEvent::Moved);
        }
        let rested_us = self.rest.elapsed_us();
        match self.detected {
            None if rested_us >= DETECT_US => {
                let side = Side::of(&(self.to_body * self.rest.specific_force_m_s2()));
                let is_new = side.is_some_and(|side| self.pending.contains(side));
                self.detected = Some((side, !is_new));
                tell(match side {
                    None => CalibrationEvent::Askew,
                    Some(side) if is_new => CalibrationEvent::Detected(side),
                    Some(side) => CalibrationEvent::Repeated(side),
                });
            }
            Some((Some(side), false)) if rested_us >= MEASURE_US => {
                self.detected = Some((Some(side), true));
                self.pending = self.pending.without(side);
                self.done_us = Some(sample.at_us);
                let read_m_s2 = self.rest.specific_force_m_s2();
                // There is a column for each side.
                self.read_m_s2
                    .column_iter_mut()
                    .nth(side as usize)
                    .into_iter()
                    .for_each(|mut it| it.copy_from(&read_m_s2));
                tell(CalibrationEvent::Done(side));
                tell(CalibrationEvent::Progress(self.pending.done_percent()));
                if self.pending.is_empty() {
                    return Some(fit(&self.read_m_s2, self.gravity_m_s2));
                }
                tell(CalibrationEvent::Pending(self.pending));
            }
            _ => (),
        }
        (sample.at_us.saturating_sub(done_us) >= PATIENCE_US).then_some(Err(CalibrationFailure::TimedOut))
    }
}

/// Solves the six equations by Newton's method, in units of gravity.
fn fit(read_m_s2: &Matrix3x6, gravity_m_s2: f32) -> Result<AccelerometerErrors, CalibrationFailure> {
    let read = read_m_s2 / gravity_m_s2;
    let mean = read.column_mean();
    let along = |axis: Vector3<f32>| read.column_iter().any(|force| axis.dot(&(force - mean)) >= ALONG_MIN);
    if !Side::ALL.into_iter().all(|side| along(side.up())) {
        return Err(CalibrationFailure::TooFewDirections);
    }
    let (mut offset, mut scale) = (Vector3::zeros(), Vector3::repeat(1.0));
    for _ in 0..STEPS {
        let (mut jacobian, mut residuals) = (Matrix6::zeros(), Vector6::zeros());
        for ((force, mut row), residual) in read.column_iter().zip(jacobian.row_iter_mut()).zip(residuals.iter_mut()) {
            let less = force - offset;
            let scaled = less.component_mul(&scale);
            *residual = 1.0 - scaled.norm_squared();
            let of_offset = -2.0 * scaled.component_mul(&scale);
            let of_scale = 2.0 * scaled.component_mul(&less);
            row.iter_mut().zip(of_offset.iter().chain(&of_scale)).for_each(|(to, from)| *to = *from);
        }
        let change = jacobian.lu().solve(&residuals).ok_or(CalibrationFailure::TooFewDirections)?;
        offset += change.fixed_rows::<3>(0);
        scale += change.fixed_rows::<3>(3);
        // NaN makes this false.
        // Wider than the final limits, because an intermediate step may overshoot.
        let is_possible =
            offset.amax() * gravity_m_s2 <= 2.0 * OFFSET_MAX_M_S2 && scale.amin() > 0.5 && scale.amax() < 2.0;
        if !is_possible {
            return Err(CalibrationFailure::TooLarge);
        }
        if change.amax() <= PRECISION {
            break;
        }
    }
    let errors = AccelerometerErrors { offset_m_s2: offset * gravity_m_s2, scale };
    let is_usual =
        errors.offset_m_s2.amax() <= OFFSET_MAX_M_S2 && (scale - Vector3::repeat(1.0)).amax() <= SCALE_ERROR_MAX;
    if is_usual { Ok(errors) } else { Err(CalibrationFailure::TooLarge) }
}

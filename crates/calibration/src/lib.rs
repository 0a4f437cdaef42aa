//! Calibration of a vehicle's own sensors on the ground, run by the vehicle itself.
//!
//! * [`GyroscopeCalibration`]: the offset, as the mean at rest.
//! * [`AccelerometerCalibration`]: offset and scale of each axis, from the vehicle at rest on each of its six sides.
//! * [`LevelCalibration`]: roll and pitch of the IMU's mounting, from the vehicle standing level.
//! * [`MagnetometerCalibration`]: offset and matrix, from the vehicle turned about the vertical on each of its sides.
//!
//! Each is a state machine that takes a [`RawSample`], reports its progress by [`CalibrationEvent`]s, and returns its
//! result or the [`CalibrationFailure`] that ended it. It keeps sums, not samples. The caller sends messages, handles
//! arming and stores results.
//!
//! ```
//! use afbc_calibration::{GyroscopeCalibration, RawSample};
//! use nalgebra::Vector3;
//!
//! let offset = Vector3::new(0.02, -0.01, 0.005);
//! let mut gyroscope = GyroscopeCalibration::default();
//! let mut found = None;
//! for number in 1..200 {
//!     let specific_force_m_s2 = Vector3::new(0.0, 0.0, 9.81);
//!     let sample = RawSample { at_us: number * 20_000, rates_rad_s: offset, specific_force_m_s2, field_ut: None };
//!     found = found.or(gyroscope.step(&sample, |_event| ()));
//! }
//! assert!(found.is_some_and(|found| found.is_ok_and(|found| (found - offset).norm() < 1e-6)));
//! ```
#![no_std]

mod accelerometer;
mod ellipsoid;
mod gyroscope;
mod level;
mod magnetometer;
mod rest;
mod side;

pub use accelerometer::{AccelerometerCalibration, AccelerometerErrors};
pub use ellipsoid::{FieldFit, FieldSums};
pub use gyroscope::GyroscopeCalibration;
pub use level::LevelCalibration;
pub use magnetometer::MagnetometerCalibration;
pub use side::{Side, Sides};

use nalgebra::Vector3;

/// Uncorrected sensor readings: the mean over some 20 ms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RawSample {
    /// Time of the newest reading, on a monotonic clock \[us\].
    pub at_us: u64,
    /// Rates, sensor axes \[rad/s\].
    pub rates_rad_s: Vector3<f32>,
    /// Specific force, sensor axes \[m/s2\].
    pub specific_force_m_s2: Vector3<f32>,
    /// Magnetic field, body frame, if the magnetometer was read \[uT\].
    pub field_ut: Option<Vector3<f32>>,
}

impl RawSample {
    /// Returns true if every number is finite.
    pub fn is_finite(&self) -> bool {
        let numbers = self.rates_rad_s.iter().chain(&self.specific_force_m_s2);
        numbers.copied().all(f32::is_finite) && self.field_ut.is_none_or(|field| field.iter().all(|it| it.is_finite()))
    }
}

/// Event during a calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum CalibrationEvent {
    /// Finished share of the work \[%\].
    Progress(u8),
    /// The vehicle has moved where it should rest; the measurement starts again.
    Moved,
    /// Remaining sides: the vehicle must be put on one of them.
    Pending(Sides),
    /// The vehicle rests, but on none of its sides.
    Askew,
    /// The vehicle rests on this side, which is measured now.
    Detected(Side),
    /// The vehicle rests on a side that is already finished.
    Repeated(Side),
    /// The vehicle must be turned about the vertical by a whole turn.
    Rotate,
    /// This side is finished.
    Done(Side),
}

/// Reason why a calibration has failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum CalibrationFailure {
    /// The vehicle did not rest.
    Moving,
    /// The requested action did not happen in time.
    TimedOut,
    /// The vehicle was not turned about the vertical.
    NotRotated,
    /// The magnetometer reads nothing.
    NoField,
    /// The vehicle does not stand level.
    NotLevel,
    /// Readings do not cover all directions.
    TooFewDirections,
    /// An error exceeds that of any sensor of this kind.
    TooLarge,
    /// The field's strength does not occur anywhere on earth.
    FieldStrength,
    /// The field differs too much between places or times.
    FieldUneven,
}

//! What the estimator says.

use crate::align::Unready;
use crate::imu::ImuHealth;
use afbc_types::State;
use nalgebra::Vector3;

/// Which parts of the state may be used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Validity {
    /// Roll and pitch; body rates with them.
    pub attitude: bool,
    /// Heading.
    pub heading: bool,
    /// Velocity, all coordinates.
    pub velocity: bool,
    /// Position, all coordinates.
    pub position: bool,
    /// Height and vertical velocity, which a barometer alone holds.
    pub height: bool,
}

/// Standard deviations of the errors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sigmas {
    /// Rotation about the earth's x, y, z; the third is the heading's \[rad\].
    pub attitude_rad: Vector3<f32>,
    /// Velocity, earth frame \[m/s\].
    pub velocity_m_s: Vector3<f32>,
    /// Position, earth frame \[m\].
    pub position_m: Vector3<f32>,
    /// Gyroscope's bias, body frame \[rad/s\].
    pub gyro_bias_rad_s: Vector3<f32>,
    /// Accelerometer's bias, body frame \[m/s2\].
    pub accel_bias_m_s2: Vector3<f32>,
    /// Barometer's offset \[m\].
    pub height_offset_m: f32,
}

/// Number of times that a part of the state was set anew rather than corrected; each up to `u32::MAX`. The first
/// position and heading after the start count, since they jump too.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Resets {
    /// Position set to a measurement.
    pub position: u32,
    /// Velocity set to a measurement.
    pub velocity: u32,
    /// Heading set to a measurement.
    pub heading: u32,
    /// The barometer's offset set to a measurement.
    pub height: u32,
    /// Roll and pitch doubted: their standard deviation raised.
    pub tilt: u32,
    /// The covariance was none any more: all but its variances was forgotten.
    pub covariance: u32,
    /// The filter started again after it had diverged or after a gap in the samples.
    pub restarts: u32,
}

/// Number of measurements that were not even looked at, each up to `u32::MAX`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dropped {
    /// Not finite, absurd, or with an unusable standard deviation.
    pub implausible: u32,
    /// Older than 270 ms when its turn came, or than the oldest state kept.
    pub late: u32,
    /// More than 20 ms in the future.
    pub early: u32,
    /// Not newer than the last one of the same kind.
    pub overtaken: u32,
    /// Pushed out of the full queue.
    pub crowded: u32,
    /// A magnetic field of another strength or inclination than at the start, or any where the vehicle's own may be as
    /// large as the earth's.
    pub disturbed: u32,
    /// The pose of a tracker, or the field of a magnetometer, that has repeated it for too long.
    pub frozen: u32,
}

/// Counts one more.
pub(crate) fn count(number: &mut u32) {
    *number = number.saturating_add(1);
}

/// State, its uncertainty and its validity; new with every call of [`Estimator::step`](crate::Estimator::step).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Estimate {
    /// Time of the state: that of the last sample of the inertial sensors \[us\].
    pub at_us: u64,
    /// The state. Always finite and [plausible](State::is_plausible); zero before the start. Rates are filtered and
    /// without bias.
    pub state: State,
    /// Attitude as a unit quaternion w, x, y, z from body to earth.
    pub attitude: [f32; 4],
    /// Bias of the gyroscope, body frame \[rad/s\].
    pub gyro_bias_rad_s: Vector3<f32>,
    /// Bias of the accelerometer, body frame \[m/s2\].
    pub accel_bias_m_s2: Vector3<f32>,
    /// Offset of the barometer: its height less the estimated one \[m\].
    pub height_offset_m: f32,
    /// Standard deviations.
    pub sigmas: Sigmas,
    /// Which parts may be used.
    pub validity: Validity,
    /// True if the vehicle is held at rest ([`Memory::set_on_ground`](crate::Memory::set_on_ground)).
    pub at_rest: bool,
    /// Why the filter has not started; `None` once it runs.
    pub unready: Option<Unready>,
    /// Health of the inertial sensors.
    pub imu: ImuHealth,
    /// Resets since the memory's beginning.
    pub resets: Resets,
    /// What measurements have changed in this step: position \[m\].
    pub moved_m: Vector3<f32>,
    /// And velocity \[m/s\].
    pub moved_m_s: Vector3<f32>,
}

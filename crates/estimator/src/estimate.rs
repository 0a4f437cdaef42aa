//! Output of the estimator: state, standard deviations, validity and counters.

use crate::align::Unready;
use crate::imu::ImuHealth;
use afbc_types::State;
use nalgebra::Vector3;

/// Parts of the state that may be used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Validity {
    /// Roll and pitch, and with them the body rates.
    pub attitude: bool,
    /// Heading.
    pub heading: bool,
    /// Velocity, all coordinates.
    pub velocity: bool,
    /// Position, all coordinates.
    pub position: bool,
    /// Height and vertical velocity, for which a barometer alone is enough.
    pub height: bool,
}

/// Standard deviations of the errors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sigmas {
    /// Rotation about the earth's x, y, z; the third is the heading \[rad\].
    pub attitude_rad: Vector3<f32>,
    /// Velocity, earth frame \[m/s\].
    pub velocity_m_s: Vector3<f32>,
    /// Position, earth frame \[m\].
    pub position_m: Vector3<f32>,
    /// Gyroscope bias, body frame \[rad/s\].
    pub gyro_bias_rad_s: Vector3<f32>,
    /// Accelerometer bias, body frame \[m/s2\].
    pub accel_bias_m_s2: Vector3<f32>,
    /// Barometer offset \[m\].
    pub height_offset_m: f32,
}

/// Number of resets of each part of the state, each up to `u32::MAX`. The first position and the first heading after
/// the start count as resets, since the state jumps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Resets {
    /// Resets of the position to a measurement.
    pub position: u32,
    /// Resets of the velocity to a measurement.
    pub velocity: u32,
    /// Resets of the heading to a measurement.
    pub heading: u32,
    /// Resets of the barometer offset to a measurement, and corrections of a height that a GNSS receiver's creeping
    /// error has moved.
    pub height: u32,
    /// Increases of the standard deviation of roll and pitch.
    pub tilt: u32,
    /// Resets of a covariance matrix that had become invalid; only the variances were kept.
    pub covariance: u32,
    /// Restarts of the filter after divergence or a gap in the samples.
    pub restarts: u32,
}

/// Number of measurements dropped before the gate, each up to `u32::MAX`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DroppedMeasurements {
    /// Measurements that were not finite, outside the plausible range, or with an unusable standard deviation.
    pub implausible: u32,
    /// Measurements older than 270 ms when their turn came, or older than the oldest stored state.
    pub late: u32,
    /// Measurements more than 20 ms in the future.
    pub early: u32,
    /// Measurements that were not newer than the last measurement of the same kind.
    pub overtaken: u32,
    /// Measurements that were pushed out of the full queue.
    pub crowded: u32,
    /// Magnetic fields whose strength or inclination differs from that at the start. Every field counts if the
    /// vehicle's own field may be as large as the earth's.
    pub disturbed: u32,
    /// Poses of a tracker or fields of a magnetometer that have repeated for too long.
    pub frozen: u32,
}

/// Increments a counter without overflow.
pub(crate) fn count(number: &mut u32) {
    *number = number.saturating_add(1);
}

/// State, standard deviations and validity. Each call of [`Estimator::step`](crate::Estimator::step) makes a new one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Estimate {
    /// Time of the state, which is the time of the last IMU sample \[us\].
    pub at_us: u64,
    /// State, always finite and [plausible](State::is_plausible), zero before the start. Rates are filtered and have no
    /// bias.
    pub state: State,
    /// Attitude from body to earth as a unit quaternion w, x, y, z.
    pub attitude: [f32; 4],
    /// Gyroscope bias, body frame \[rad/s\].
    pub gyro_bias_rad_s: Vector3<f32>,
    /// Accelerometer bias, body frame \[m/s2\].
    pub accel_bias_m_s2: Vector3<f32>,
    /// Barometer offset: barometer height minus estimated height \[m\].
    pub height_offset_m: f32,
    /// Standard deviations.
    pub sigmas: Sigmas,
    /// Parts of the state that may be used.
    pub validity: Validity,
    /// True if the filter holds the vehicle at rest ([`Memory::set_on_ground`](crate::Memory::set_on_ground)).
    pub at_rest: bool,
    /// Reason why the filter has not started, `None` once it runs.
    pub unready: Option<Unready>,
    /// Health of the inertial sensors.
    pub imu: ImuHealth,
    /// Resets since the memory was created.
    pub resets: Resets,
    /// Change of the position by measurements in this step \[m\].
    pub moved_m: Vector3<f32>,
    /// Change of the velocity by measurements in this step \[m/s\].
    pub moved_m_s: Vector3<f32>,
}

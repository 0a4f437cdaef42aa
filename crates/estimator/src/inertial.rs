//! State at the last IMU sample, for users that need it without the full estimate.

use nalgebra::{Matrix3, Vector3};

/// State at the time of the last IMU sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InertialState {
    /// Time of the sample \[us\].
    pub at_us: u64,
    /// Rotation from body to earth.
    pub rotation: Matrix3<f32>,
    /// Velocity in the earth frame \[m/s\].
    pub velocity: Vector3<f32>,
    /// Body rates of the sample, bias removed \[rad/s\].
    pub rates: Vector3<f32>,
    /// Specific force of the sample in the body frame, bias removed \[m/s2\].
    pub force: Vector3<f32>,
    /// Gyroscope bias \[rad/s\].
    pub gyro_bias: Vector3<f32>,
    /// Accelerometer bias \[m/s2\].
    pub accel_bias: Vector3<f32>,
    /// Acceleration of gravity \[m/s2\].
    pub gravity: f32,
    /// Rotation from the sensor axes to the body axes.
    pub to_body: Matrix3<f32>,
}

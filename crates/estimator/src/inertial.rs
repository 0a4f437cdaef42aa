//! The estimate as an inertial sensor's samples move it.

use nalgebra::{Matrix3, Vector3};

/// What is known at the time of the last sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inertial {
    /// Time of the sample \[us\].
    pub at_us: u64,
    /// Attitude: body to earth.
    pub rotation: Matrix3<f32>,
    /// In the earth frame \[m/s\].
    pub velocity: Vector3<f32>,
    /// Rates of the sample without bias, in the body's axes \[rad/s\].
    pub rates: Vector3<f32>,
    /// Specific force of the sample without bias, in the body's axes \[m/s2\].
    pub force: Vector3<f32>,
    /// Bias of the rates \[rad/s\].
    pub gyro_bias: Vector3<f32>,
    /// Bias of the specific force \[m/s2\].
    pub accel_bias: Vector3<f32>,
    /// Acceleration of gravity \[m/s2\].
    pub gravity: f32,
    /// From the sensor's axes to the body's.
    pub to_body: Matrix3<f32>,
}

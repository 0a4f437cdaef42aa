//! Nominal state: integrates the IMU samples without their biases.
//!
//! ```text
//! dq/dt = q (x) [0, w - b_g]/2        dv/dt = R(q) (f - b_a) - g e_z        dp/dt = v
//! ```
//!
//! Sola, *Quaternion kinematics for the error-state Kalman filter*, 2017, section 5.3. Each sample is integrated with
//! the previous one by the trapezoidal rule. The rotation adds the coning term w_1 x w_2 dt^2 / 12 of Savage,
//! *Strapdown Inertial Navigation Integration Algorithm Design*, 1998.

use crate::measurement::ImuSample;
use crate::rotation::{identity, matrix, renormalized, small};
use nalgebra::{Matrix3, Quaternion, Vector3};

/// Nominal state at the time of the last sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NominalState {
    /// Attitude, body to earth.
    pub(crate) attitude: Quaternion<f32>,
    /// Attitude as a matrix.
    pub(crate) rotation: Matrix3<f32>,
    /// Velocity, earth frame \[m/s\].
    pub(crate) velocity: Vector3<f32>,
    /// Position, earth frame \[m\].
    pub(crate) position: Vector3<f32>,
    /// Rounding error of the position sum: at 1 km a slow vehicle's step of a millisecond is below the last bit.
    carry: Vector3<f32>,
    /// Gyroscope bias \[rad/s\].
    pub(crate) gyro_bias: Vector3<f32>,
    /// Accelerometer bias \[m/s2\].
    pub(crate) accel_bias: Vector3<f32>,
    /// Rates of the last sample without bias, body frame \[rad/s\].
    pub(crate) rates: Vector3<f32>,
    /// Specific force of the last sample without bias, body frame \[m/s2\].
    pub(crate) force: Vector3<f32>,
}

impl Default for NominalState {
    fn default() -> Self {
        let zero = Vector3::zeros();
        NominalState {
            attitude: identity(),
            rotation: Matrix3::identity(),
            velocity: zero,
            position: zero,
            carry: zero,
            gyro_bias: zero,
            accel_bias: zero,
            rates: zero,
            force: zero,
        }
    }
}

impl NominalState {
    /// Creates a state with this attitude, at rest at the origin, without biases.
    pub(crate) fn new(attitude: Quaternion<f32>) -> Self {
        let mut new = NominalState::default();
        new.turn_to(attitude);
        new
    }

    /// Takes the first sample, which leaves nothing to integrate yet.
    pub(crate) fn begin(&mut self, sample: &ImuSample) {
        self.rates = sample.rates_rad_s - self.gyro_bias;
        self.force = sample.specific_force_m_s2 - self.accel_bias;
    }

    /// Sets the attitude to a unit quaternion.
    pub(crate) fn turn_to(&mut self, attitude: Quaternion<f32>) {
        self.attitude = attitude;
        self.rotation = matrix(&attitude);
    }

    /// Adds a correction to the position.
    pub(crate) fn move_by(&mut self, by: &Vector3<f32>) {
        self.position += by;
    }

    /// Sets the position.
    pub(crate) fn move_to(&mut self, position: Vector3<f32>) {
        self.position = position;
        self.carry = Vector3::zeros();
    }

    /// Integrates up to `sample`, which is `dt_s` after the last sample. Returns the velocity change by specific force
    /// in the earth frame \[m/s\].
    #[inline]
    pub(crate) fn advance(&mut self, sample: &ImuSample, dt_s: f32, gravity: f32) -> Vector3<f32> {
        let rates = sample.rates_rad_s - self.gyro_bias;
        let force = sample.specific_force_m_s2 - self.accel_bias;
        let half = 0.5 * dt_s;
        let coning = self.rates.cross(&rates) * (dt_s * dt_s * (1.0 / 12.0));
        let before = self.rotation * self.force;
        self.turn_to(renormalized(&(self.attitude * small(&((self.rates + rates) * half + coning)))));
        let change = (before + self.rotation * force) * half;
        let mut velocity = self.velocity + change;
        velocity.z -= gravity * dt_s;
        // Kahan summation.
        let step = (self.velocity + velocity) * half - self.carry;
        let position = self.position + step;
        self.carry = (position - self.position) - step;
        (self.position, self.velocity, self.rates, self.force) = (position, velocity, rates, force);
        change
    }

    /// Returns true if every number is finite and position and speed are possible.
    pub(crate) fn is_sound(&self) -> bool {
        let q = &self.attitude;
        let turned = q.norm_squared();
        let far = afbc_control::math::abs_max(&self.position);
        let fast = afbc_control::math::abs_max(&self.velocity);
        let biases = (self.gyro_bias + self.accel_bias + self.rates + self.force).norm_squared();
        // NaN makes the result false.
        let sums = turned + self.position.norm_squared() + self.velocity.norm_squared() + biases;
        sums.is_finite() && (turned - 1.0).abs() < 0.01 && far < 9e4 && fast < 300.0
    }
}

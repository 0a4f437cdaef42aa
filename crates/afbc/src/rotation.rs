//! Attitude errors as a rotation, with tilt before yaw. Not in the paper, which takes differences of Euler angles (9)
//! and d eta/dt for Omega (6). That is right in hover, but wrong by a factor beyond 45 degrees of tilt.
//!
//! R_d has the roll and pitch of (40) after the command filter, and the yaw of the reference. R_e = R' R_d = R_tilt
//! R_yaw splits into the shortest turn of the thrust and a turn about the thrust (Brescianini and D'Andrea,
//! *Tilt-prioritized quadrocopter attitude control*, IEEE TCST 28(2), 2020). With n = R_e e_z and the angle a of R_yaw:
//!
//! ```text
//! e_1  =  [-n_y, n_x, 0] / sqrt((1 + n_z)/2) + [0, 0, 2 sin(a/2)]     twice the sine of half of each angle
//! (1 + n_z) [cos a, sin a]  =  [R_e11 + R_e22, R_e21 - R_e12]
//! x_2  =  Omega      dx_1d/dt  =  R_e Omega_d      d^2 x_1d/dt^2  =  R_e dOmega_d/dt - Omega x R_e Omega_d
//! ```
//!
//! For small errors de_1/dt = dx_1d/dt - x_2, which is all that Section III needs of (9). Omega_d and its derivative
//! follow from the derivatives of the angles by the kinematics of Euler angles.

use crate::model::RollPitch;
use afbc_control::math;
use nalgebra::{Matrix3, Vector3};

/// Smallest divisor 1 + cos of an angle: errors of more than 164 degrees grow no further.
const HALF_MIN: f32 = 0.04;

/// Attitude errors and reference derivatives for roll, pitch and yaw, about the body axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AttitudeTracking {
    /// e_1 \[rad\].
    pub error: Vector3<f32>,
    /// d x_1d/dt \[rad/s\].
    pub rates: Vector3<f32>,
    /// d^2 x_1d/dt^2 \[rad/s2\].
    pub accelerations: Vector3<f32>,
    /// Part R_e dOmega_d/dt of the accelerations, without the body rates \[rad/s2\].
    pub desired_accelerations: Vector3<f32>,
}

impl AttitudeTracking {
    /// Returns the errors of a body at R with rates Omega from the desired attitude. `heading` is the sine and cosine
    /// of the desired yaw; the desired angles change by `eta_dot` \[rad/s\] and `eta_ddot` \[rad/s2\].
    #[inline(always)]
    pub fn new(
        r_earth_body: &Matrix3<f32>,
        desired: &RollPitch,
        heading: [f32; 2],
        omega: &Vector3<f32>,
        [eta_dot, eta_ddot]: [&Vector3<f32>; 2],
    ) -> Self {
        let to_body = r_earth_body.tr_mul(&desired.r_earth_body(heading));
        let omega_d = desired.body_rates(eta_dot);
        let omega_d_dot = desired.body_accelerations(&omega_d, eta_dot, eta_ddot);
        let rates = to_body * omega_d;
        let desired_accelerations = to_body * omega_d_dot;
        let accelerations = desired_accelerations - omega.cross(&rates);
        AttitudeTracking { error: error(&to_body), rates, accelerations, desired_accelerations }
    }

    /// Returns the errors as differences of Euler angles (9), as in the paper, with yaw the shorter way round.
    #[inline(always)]
    pub fn of_angles(
        eta_d: &Vector3<f32>,
        eta: &Vector3<f32>,
        eta_d_dot: Vector3<f32>,
        eta_d_ddot: Vector3<f32>,
    ) -> Self {
        let error = Vector3::new(eta_d.x - eta.x, eta_d.y - eta.y, math::wrap_angle(eta_d.z - eta.z));
        AttitudeTracking { error, rates: eta_d_dot, accelerations: eta_d_ddot, desired_accelerations: eta_d_ddot }
    }
}

/// Returns e_1 for R_e: in rad for small angles, and at most 2.
#[inline(always)]
pub fn error(r_body_desired: &Matrix3<f32>) -> Vector3<f32> {
    let r = r_body_desired;
    let upright = math::max(1.0 + r.m33, HALF_MIN);
    let [cos, sin] = [(r.m11 + r.m22) / upright, (r.m21 - r.m12) / upright];
    let per_tilt = 1.0 / math::sqrt(0.5 * upright);
    let per_yaw = 1.0 / math::sqrt(0.5 * math::max(1.0 + cos, HALF_MIN));
    Vector3::new(-r.m23 * per_tilt, r.m13 * per_tilt, sin * per_yaw)
}

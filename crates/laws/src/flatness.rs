//! Differential flatness: attitude, body rates and angular accelerations from a specific force with two derivatives and
//! a heading.
//!
//! Mellinger and Kumar, *Minimum snap trajectory generation and control for quadrotors*, ICRA 2011, for an Euler yaw of
//! psi_d. With the specific force s, c = |s|, R_d = \[b1 b2 b3\], b3 = s / c, x_C along the heading, y_C horizontal to
//! its left, and b1 perpendicular to y_C:
//!
//! ```text
//! Omega_1 = -b2 . ds/dt / c,   Omega_2 = b1 . ds/dt / c,   dc/dt = b3 . ds/dt
//! Omega_3 = (dpsi_d/dt b1 . x_C + Omega_2 b3 . y_C) / (b2 . y_C)
//! dOmega_1/dt = -b2 . d2s/dt2 / c - 2 dc/dt / c Omega_1 + Omega_2 Omega_3
//! dOmega_2/dt =  b1 . d2s/dt2 / c - 2 dc/dt / c Omega_2 - Omega_1 Omega_3
//! dOmega_3/dt = (d2psi_d/dt2 b1 . x_C + (dOmega_2/dt - Omega_1 Omega_3) b3 . y_C
//!               + 2 dpsi_d/dt (Omega_3 b2 . x_C - Omega_2 b3 . x_C)) / (b2 . y_C) - Omega_1 Omega_2
//! ```

use crate::attitude::{facing, heading, length};
use afbc_types::Setpoint;
use nalgebra::{Matrix3, Vector3};

/// Desired attitude R_d with Omega_d and dOmega_d/dt in the desired frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AttitudeReference {
    /// R_d: desired frame to earth.
    pub r_earth_desired: Matrix3<f32>,
    /// Omega_d \[rad/s\].
    pub rates_rad_s: Vector3<f32>,
    /// dOmega_d/dt \[rad/s2\].
    pub rates_dot_rad_s2: Vector3<f32>,
}

/// Desired attitude and its heading.
pub(crate) struct DesiredFrame {
    pub(crate) r: Matrix3<f32>,
    /// x_C
    along: Vector3<f32>,
    /// y_C
    left: Vector3<f32>,
    /// 1 / c \[s2/m\]
    per_length: f32,
}

impl DesiredFrame {
    /// Creates the attitude along a specific force that points up.
    #[inline]
    pub(crate) fn new(specific_force: &Vector3<f32>, yaw_rad: f32) -> Self {
        let [along, left] = heading(yaw_rad);
        DesiredFrame { r: facing(specific_force, yaw_rad), along, left, per_length: 1.0 / length(specific_force) }
    }

    /// Returns Omega_d for ds/dt and the heading's rate. With d2s/dt2 and the heading's acceleration it returns
    /// dOmega_d/dt without the products of rates.
    #[inline]
    pub(crate) fn turn(&self, s_dot: &Vector3<f32>, yaw_dot: f32) -> Vector3<f32> {
        let (b1, b2, b3) = (self.r.column(0), self.r.column(1), self.r.column(2));
        let (p, q) = (-b2.dot(s_dot) * self.per_length, b1.dot(s_dot) * self.per_length);
        // b2 . left is the cosine of the roll, positive because s points up.
        Vector3::new(p, q, (yaw_dot * b1.dot(&self.along) + q * b3.dot(&self.left)) / b2.dot(&self.left))
    }
}

/// Returns the attitude along a specific force with two derivatives \[m/s2, m/s3, m/s4\], at the setpoint's heading.
/// The specific force must point up.
// This function is always inlined: a result returned in memory would be read back while its stores are still pending.
#[inline(always)]
pub fn flat(specific_force: [Vector3<f32>; 3], setpoint: &Setpoint) -> AttitudeReference {
    let [s, s_dot, s_ddot] = specific_force;
    let frame = DesiredFrame::new(&s, setpoint.yaw_rad);
    let (b2, b3) = (frame.r.column(1), frame.r.column(2));
    let yaw_dot = setpoint.yaw_rate_rad_s;
    let rates = frame.turn(&s_dot, yaw_dot);
    let (p, q, r) = (rates.x, rates.y, rates.z);
    // 2 dc/dt / c
    let stretch = 2.0 * b3.dot(&s_dot) * frame.per_length;
    let linear = frame.turn(&s_ddot, setpoint.yaw_acceleration_rad_s2);
    let (lean, upright) = (b3.dot(&frame.left), b2.dot(&frame.left));
    let turning = 2.0 * yaw_dot * (r * b2.dot(&frame.along) - q * b3.dot(&frame.along));
    let products = Vector3::new(
        q * r - stretch * p,
        -p * r - stretch * q,
        (turning - (stretch * q + 2.0 * p * r) * lean) / upright - p * q,
    );
    AttitudeReference { r_earth_desired: frame.r, rates_rad_s: rates, rates_dot_rad_s2: linear + products }
}

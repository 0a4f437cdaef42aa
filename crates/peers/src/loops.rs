//! Outer loops of PID and INDI: from position to acceleration, and from attitude to rates.

use crate::attitude::{facing, tilt_prioritised_error};
use crate::limits::cylinder;
use afbc_types::{Setpoint, State};
use nalgebra::{Matrix3, Vector3};

/// Returns a vector with one gain for x and y, another for z.
pub(crate) fn xy_and_z(xy: f32, z: f32) -> Vector3<f32> {
    Vector3::new(xy, xy, z)
}

/// From position to velocity to acceleration: a_d + k_v (v_d + sat(k_p (p_d - p)) - v).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PositionLoop {
    /// k_p \[1/s\]
    pub(crate) position_p: Vector3<f32>,
    /// k_v \[1/s\]
    pub(crate) velocity_p: Vector3<f32>,
    /// Largest sat(...) \[m/s\].
    pub(crate) speed_max_m_s: f32,
}

/// Errors and demanded acceleration, earth frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PositionOutput {
    pub(crate) position_error_m: Vector3<f32>,
    pub(crate) velocity_error_m_s: Vector3<f32>,
    pub(crate) acceleration_m_s2: Vector3<f32>,
}

impl PositionLoop {
    /// Computes one step.
    #[inline]
    pub(crate) fn output(&self, state: &State, setpoint: &Setpoint) -> PositionOutput {
        let position_error_m = setpoint.position_m - state.position_m;
        let velocity_m_s =
            setpoint.velocity_m_s + cylinder(&self.position_p.component_mul(&position_error_m), self.speed_max_m_s);
        let velocity_error_m_s = velocity_m_s - state.velocity_m_s;
        let acceleration_m_s2 = setpoint.acceleration_m_s2 + self.velocity_p.component_mul(&velocity_error_m_s);
        PositionOutput { position_error_m, velocity_error_m_s, acceleration_m_s2 }
    }
}

/// From attitude to rates: k_a e(R, R_d) + R' e_z dpsi_d/dt, e tilt-prioritised.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AttitudeLoop {
    /// k_a; that of yaw divided by its weight \[1/s\].
    attitude_p: Vector3<f32>,
    yaw_weight: f32,
}

/// Desired attitude; errors and demanded rates in the body frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AttitudeOutput {
    /// R_d
    pub(crate) desired: Matrix3<f32>,
    pub(crate) attitude_error_rad: Vector3<f32>,
    pub(crate) rates_rad_s: Vector3<f32>,
    pub(crate) rate_error_rad_s: Vector3<f32>,
}

impl AttitudeLoop {
    /// Makes the loop; `yaw_p_1_s` is the gain for small yaw errors, whatever `yaw_weight` is.
    pub(crate) fn new(tilt_p_1_s: f32, yaw_p_1_s: f32, yaw_weight: f32) -> Self {
        AttitudeLoop { attitude_p: xy_and_z(tilt_p_1_s, yaw_p_1_s / yaw_weight), yaw_weight }
    }

    /// Computes one step in the attitude `r`, for a thrust along `specific_force`, which must point up.
    #[inline]
    pub(crate) fn output(
        &self,
        r: &Matrix3<f32>,
        specific_force: &Vector3<f32>,
        state: &State,
        setpoint: &Setpoint,
    ) -> AttitudeOutput {
        let desired = facing(specific_force, setpoint.yaw_rad);
        let attitude_error_rad = tilt_prioritised_error(r, &desired, self.yaw_weight);
        let earth_z = r.row(2).transpose();
        let rates_rad_s = self.attitude_p.component_mul(&attitude_error_rad) + earth_z * setpoint.yaw_rate_rad_s;
        AttitudeOutput { desired, attitude_error_rad, rates_rad_s, rate_error_rad_s: rates_rad_s - state.rates_rad_s }
    }
}

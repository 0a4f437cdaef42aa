//! Outer loops: position to acceleration, cascaded (PID, INDI) or from one error (geometric, DFBC), and attitude to
//! rates.

use crate::attitude::tilt_prioritised_error;
use crate::integral::{away_from, integrate};
use crate::limits::{SpecificForceLimits, cylinder};
use afbc_types::{Setpoint, State};
use nalgebra::{Matrix3, Vector3};

/// Returns a vector with one gain for x and y, another for z.
pub(crate) fn xy_and_z(xy: f32, z: f32) -> Vector3<f32> {
    Vector3::new(xy, xy, z)
}

/// Position loop via velocity to acceleration: a_d + k_v (v_d + sat(k_p (p_d - p)) - v).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PositionLoop {
    /// k_p \[1/s\]
    pub(crate) position_p: Vector3<f32>,
    /// k_v \[1/s\]
    pub(crate) velocity_p: Vector3<f32>,
    /// Largest speed sat(...) \[m/s\].
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

/// Position loop directly to acceleration: k_x (p_d - p) + k_v (v_d - v) + sat(k_i int (p_d - p)) + a_d.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TrackingLoop {
    /// k_x \[1/s2\]
    pub(crate) position_p: Vector3<f32>,
    /// k_v \[1/s\]
    pub(crate) position_d: Vector3<f32>,
    /// k_i \[1/s3\]
    pub(crate) position_i: Vector3<f32>,
    /// Largest integral, per coordinate \[m/s2\].
    pub(crate) integral_max_m_s2: f32,
    pub(crate) limits: SpecificForceLimits,
    pub(crate) dt_s: f32,
}

/// Errors, demanded acceleration and specific force, earth frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TrackingOutput {
    pub(crate) position_error_m: Vector3<f32>,
    pub(crate) velocity_error_m_s: Vector3<f32>,
    pub(crate) acceleration_m_s2: Vector3<f32>,
    /// Specific force within the limits.
    pub(crate) specific_force_m_s2: Vector3<f32>,
    /// Part of the specific force that the limits cut off.
    missing_m_s2: Vector3<f32>,
}

impl TrackingLoop {
    /// Computes one step; `integral` is sat(k_i int (p_d - p)).
    #[inline]
    pub(crate) fn output(&self, state: &State, setpoint: &Setpoint, integral: &Vector3<f32>) -> TrackingOutput {
        let position_error_m = setpoint.position_m - state.position_m;
        let velocity_error_m_s = setpoint.velocity_m_s - state.velocity_m_s;
        let acceleration_m_s2 = self.position_p.component_mul(&position_error_m)
            + self.position_d.component_mul(&velocity_error_m_s)
            + integral
            + setpoint.acceleration_m_s2;
        let wanted = acceleration_m_s2 + self.limits.gravity();
        let specific_force_m_s2 = self.limits.apply(&wanted);
        let missing_m_s2 = wanted - specific_force_m_s2;
        TrackingOutput { position_error_m, velocity_error_m_s, acceleration_m_s2, specific_force_m_s2, missing_m_s2 }
    }

    /// Advances the integral, but not in the direction that the limits cut off.
    #[inline]
    pub(crate) fn learn(&self, integral: &mut Vector3<f32>, output: &TrackingOutput) {
        let allowed = output.position_error_m.zip_map(&output.missing_m_s2, away_from);
        *integral = integrate(integral, &self.position_i.component_mul(&allowed), self.dt_s, self.integral_max_m_s2);
    }
}

/// Attitude loop to rates: k_a e(R, R_d) + Omega_ff, with the tilt-prioritised e.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AttitudeLoop {
    /// k_a \[1/s\]; the value for yaw is divided by the yaw weight.
    attitude_p: Vector3<f32>,
    yaw_weight: f32,
}

/// Errors and demanded rates in the body frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AttitudeOutput {
    pub(crate) attitude_error_rad: Vector3<f32>,
    pub(crate) rates_rad_s: Vector3<f32>,
    pub(crate) rate_error_rad_s: Vector3<f32>,
}

impl AttitudeLoop {
    /// Creates the loop. `yaw_p_1_s` is the gain for small yaw errors, whatever `yaw_weight` is.
    pub(crate) fn new(tilt_p_1_s: f32, yaw_p_1_s: f32, yaw_weight: f32) -> Self {
        // The error already contains the weight, which is at least 0.05 by its range.
        AttitudeLoop { attitude_p: xy_and_z(tilt_p_1_s, yaw_p_1_s / yaw_weight), yaw_weight }
    }

    /// Computes one step in the attitude `r`, towards `desired`, with `feed_forward_rad_s` in the body frame.
    // This function is always inlined: a result returned in memory would be read back while its stores are still
    // pending.
    #[inline(always)]
    pub(crate) fn output(
        &self,
        r: &Matrix3<f32>,
        desired: &Matrix3<f32>,
        feed_forward_rad_s: &Vector3<f32>,
        state: &State,
    ) -> AttitudeOutput {
        let attitude_error_rad = tilt_prioritised_error(r, desired, self.yaw_weight);
        let rates_rad_s = self.attitude_p.component_mul(&attitude_error_rad) + feed_forward_rad_s;
        AttitudeOutput { attitude_error_rad, rates_rad_s, rate_error_rad_s: rates_rad_s - state.rates_rad_s }
    }
}

//! Attitude control along a specific force, with the reference's rates and angular accelerations as feed-forward and
//! incremental inversion of the moments. Shared by DFBC and MPC; the head of [`crate::dfbc`] has the equations.

use crate::attitude::{facing, tilt_and_yaw_error};
use crate::differentiator::Differentiator;
use crate::flatness::flat;
use crate::increment::{Increment, IncrementMemory};
use crate::loops::xy_and_z;
use afbc_control::drag::KnownDrag;
use afbc_types::{OutOfRange, Setpoint, State};
use nalgebra::{Matrix3, Vector3};

/// Gains k_R and k_Omega \[1/s2, 1/s\] of tilt and yaw, and bandwidth of the filter \[rad/s\].
pub(crate) struct AttitudeGains {
    pub(crate) tilt: [f32; 2],
    pub(crate) yaw: [f32; 2],
    pub(crate) filter_rad_s: f32,
}

/// Attitude loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FlatAttitude {
    increment: Increment,
    k_r: Vector3<f32>,
    k_omega: Vector3<f32>,
}

/// Output of the attitude loop.
pub(crate) struct AttitudeDemand {
    pub(crate) desired: Matrix3<f32>,
    /// Rates of the reference, in the reference's frame.
    pub(crate) rates_rad_s: Vector3<f32>,
    pub(crate) angular_acceleration_rad_s2: Vector3<f32>,
    pub(crate) attitude_error: Vector3<f32>,
    pub(crate) rate_error: Vector3<f32>,
}

impl FlatAttitude {
    /// Creates the attitude loop.
    ///
    /// # Errors
    /// Returns an error if the filter's bandwidth is out of range.
    pub(crate) fn new(gains: &AttitudeGains, dt_s: f32) -> Result<Self, OutOfRange> {
        let ([tilt_p, tilt_d], [yaw_p, yaw_d]) = (gains.tilt, gains.yaw);
        Ok(FlatAttitude {
            increment: Increment(Differentiator::new(gains.filter_rad_s, dt_s)?),
            k_r: xy_and_z(tilt_p, yaw_p),
            k_omega: xy_and_z(tilt_d, yaw_d),
        })
    }

    /// Filters inputs and rates, see [`Increment::measure`].
    #[inline]
    pub(crate) fn measure(
        &self,
        reaction: &mut IncrementMemory,
        given_rad_s2: &Vector3<f32>,
        rates_rad_s: &Vector3<f32>,
    ) {
        self.increment.measure(reaction, given_rad_s2, rates_rad_s);
    }

    /// Turns the attitude `r` along the specific force `along`. The feed-forward rates follow from the reference's
    /// specific force and the setpoint's jerk, snap and heading.
    #[inline]
    pub(crate) fn output(
        &self,
        reaction: &IncrementMemory,
        r: &Matrix3<f32>,
        state: &State,
        [along, reference]: [&Vector3<f32>; 2],
        setpoint: &Setpoint,
    ) -> AttitudeDemand {
        let omega = state.rates_rad_s;
        let desired = facing(along, setpoint.yaw_rad);
        let reference = flat([*reference, setpoint.jerk_m_s3, setpoint.snap_m_s4], setpoint);
        let to_body = r.transpose() * reference.r_earth_desired;
        let omega_r = to_body * reference.rates_rad_s;
        let attitude_error = tilt_and_yaw_error(r, &desired);
        let rate_error = omega_r - omega;
        let nu = self.k_r.component_mul(&attitude_error)
            + self.k_omega.component_mul(&rate_error)
            + to_body * reference.rates_dot_rad_s2
            - omega.cross(&omega_r);
        AttitudeDemand {
            desired,
            rates_rad_s: reference.rates_rad_s,
            angular_acceleration_rad_s2: self.increment.invert(reaction, &nu),
            attitude_error,
            rate_error,
        }
    }
}

/// Returns the setpoint with jerk and snap of the thrust instead of the acceleration: drag turns the thrust as the
/// velocity changes. `up` is the thrust's direction; `thrust` is its share of the hover thrust, and the thrust per mass
/// \[m/s2\].
#[inline]
pub(crate) fn dragged(drag: &KnownDrag, setpoint: &Setpoint, up: &Vector3<f32>, thrust: [f32; 2]) -> Setpoint {
    let Setpoint { velocity_m_s: v, acceleration_m_s2: a, jerk_m_s3: j, snap_m_s4: s, .. } = setpoint;
    let [jerk_m_s3, snap_m_s4] = drag.followed(v, up, thrust, [a, j, s]);
    Setpoint { jerk_m_s3, snap_m_s4, ..*setpoint }
}

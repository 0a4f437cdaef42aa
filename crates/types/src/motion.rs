//! Measured state and desired motion of the vehicle.

use nalgebra::Vector3;

/// Measured motion of the vehicle, by the paper's assumption A1. Frames as in the crate's [conventions](crate).
///
/// Fields may be added in later versions: end a literal with `..State::default()`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct State {
    /// Position xi = \[x, y, z\], earth frame \[m\].
    pub position_m: Vector3<f32>,
    /// Velocity d xi/dt, earth frame \[m/s\].
    pub velocity_m_s: Vector3<f32>,
    /// Attitude eta = \[roll, pitch, yaw\] \[rad\].
    pub attitude_rad: Vector3<f32>,
    /// Body rates Omega = \[p, q, r\], body frame \[rad/s\]. The paper's model (6) uses d eta/dt instead.
    pub rates_rad_s: Vector3<f32>,
}

/// Largest position of a state, pose or setpoint, per coordinate \[m\].
pub(crate) const POSITION_MAX_M: f32 = 1e5;
/// Largest speed, per coordinate \[m/s\].
const VELOCITY_MAX_M_S: f32 = 1e3;
/// Largest acceleration of a setpoint, per coordinate \[m/s2\].
const ACCELERATION_MAX_M_S2: f32 = 1e3;
/// Largest jerk of a setpoint, per coordinate \[m/s3\]: that of the largest acceleration on a circle flown in 0.06 s.
const JERK_MAX_M_S3: f32 = 1e5;
/// Largest snap of a setpoint, per coordinate \[m/s4\]: that of the largest jerk on the same circle.
const SNAP_MAX_M_S4: f32 = 1e7;
/// Largest angle \[rad\]. More than a turn, because yaw may be unwrapped.
const ANGLE_MAX_RAD: f32 = 1e3;
/// Largest angular rate, per coordinate \[rad/s\].
const RATE_MAX_RAD_S: f32 = 1e3;
/// Number that is within the bounds of a velocity, of an angle and of a rate.
const REST_MAX: f32 = 1e3;
const _: () = assert!(REST_MAX <= VELOCITY_MAX_M_S && REST_MAX <= ANGLE_MAX_RAD && REST_MAX <= RATE_MAX_RAD_S);
/// Largest heading and derivatives of the heading \[rad, rad/s, rad/s2\].
const HEADING_MAX: f32 = 1e3;

/// Returns a number whose highest bit is set if a coordinate is larger than `max` in size or NaN.
fn excess(vector: &Vector3<f32>, max: f32) -> u32 {
    // The bits of positive numbers are in the order of the numbers, with NaN last. A negative difference sets the
    // highest bit, so one branch suffices for a whole state.
    let excess = vector.map(|value| max.to_bits().wrapping_sub(value.abs().to_bits()));
    excess.x | excess.y | excess.z
}

/// True if each vector is finite and within its bound, per coordinate.
#[inline]
pub(crate) fn within<const N: usize>(vectors: [(&Vector3<f32>, f32); N]) -> bool {
    vectors.into_iter().fold(0, |any, (vector, max)| any | excess(vector, max)) >> 31 == 0
}

impl State {
    /// True if every value is finite and physically possible: at most 1e5 m, 1e3 m/s, 1e3 rad and 1e3 rad/s in size.
    /// Controllers must reject other states.
    pub fn is_plausible(&self) -> bool {
        // Nearly every state passes by its sums of squares, which takes fewer instructions than the exact check. A sum
        // with a number that is not finite is not within any bound.
        let State { position_m, velocity_m_s, attitude_rad, rates_rad_s } = self;
        let rest = velocity_m_s.norm_squared() + attitude_rad.norm_squared() + rates_rad_s.norm_squared();
        let is_small = position_m.norm_squared() <= POSITION_MAX_M * POSITION_MAX_M && rest <= REST_MAX * REST_MAX;
        is_small
            || within([
                (position_m, POSITION_MAX_M),
                (velocity_m_s, VELOCITY_MAX_M_S),
                (attitude_rad, ANGLE_MAX_RAD),
                (rates_rad_s, RATE_MAX_RAD_S),
            ])
    }
}

/// Estimator reset: change of an estimate by a jump, while the vehicle itself has not moved. Shift setpoints by the
/// same change, so that the vehicle does not move because of the jump.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ResetDelta {
    /// Position after minus before the reset, earth frame \[m\].
    pub position_m: Vector3<f32>,
    /// Heading after minus before the reset \[rad\].
    pub yaw_rad: f32,
}

/// Desired motion: \[x_d, y_d, z_d, psi_d\] with two derivatives (assumption A5). Two more derivatives of the position
/// (not in the paper) are for laws that feed them forward. Set unknown jerk and snap to zero. The link does so, since
/// its messages have neither.
///
/// Fields may be added in later versions: end a literal with `..Setpoint::default()`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Setpoint {
    /// Position, earth frame \[m\].
    pub position_m: Vector3<f32>,
    /// Velocity, earth frame \[m/s\].
    pub velocity_m_s: Vector3<f32>,
    /// Acceleration, earth frame \[m/s2\].
    pub acceleration_m_s2: Vector3<f32>,
    /// Jerk, the derivative of the acceleration, earth frame \[m/s3\].
    pub jerk_m_s3: Vector3<f32>,
    /// Snap, the derivative of the jerk, earth frame \[m/s4\].
    pub snap_m_s4: Vector3<f32>,
    /// Heading psi_d \[rad\].
    pub yaw_rad: f32,
    /// Yaw rate \[rad/s\].
    pub yaw_rate_rad_s: f32,
    /// Yaw acceleration \[rad/s2\].
    pub yaw_acceleration_rad_s2: f32,
}

impl Setpoint {
    /// Returns the setpoint that holds the position and heading of `state`, at rest.
    pub fn hold(state: &State) -> Self {
        Setpoint { position_m: state.position_m, yaw_rad: state.attitude_rad.z, ..Setpoint::default() }
    }

    /// True if every value is finite and within the bounds of [`State::is_plausible`], with accelerations of at most
    /// 1e3 m/s2 and 1e3 rad/s2, jerk of at most 1e5 m/s3 and snap of at most 1e7 m/s4.
    pub fn is_plausible(&self) -> bool {
        let heading = Vector3::new(self.yaw_rad, self.yaw_rate_rad_s, self.yaw_acceleration_rad_s2);
        within([
            (&self.position_m, POSITION_MAX_M),
            (&self.velocity_m_s, VELOCITY_MAX_M_S),
            (&self.acceleration_m_s2, ACCELERATION_MAX_M_S2),
            (&self.jerk_m_s3, JERK_MAX_M_S3),
            (&self.snap_m_s4, SNAP_MAX_M_S4),
            (&heading, HEADING_MAX),
        ])
    }
}

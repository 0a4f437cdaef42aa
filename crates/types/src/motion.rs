//! Measured state and desired motion of the vehicle.

use nalgebra::Vector3;

/// Measured motion of the vehicle: the paper's assumption A1. Frames as in the crate's [conventions](crate).
///
/// Fields may be added: a literal ends in `..State::default()`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct State {
    /// xi = \[x, y, z\], earth frame \[m\].
    pub position_m: Vector3<f32>,
    /// d xi/dt, earth frame \[m/s\].
    pub velocity_m_s: Vector3<f32>,
    /// eta = \[roll, pitch, yaw\] \[rad\].
    pub attitude_rad: Vector3<f32>,
    /// Omega = \[p, q, r\], body frame \[rad/s\]. The paper's model (6) takes d eta/dt for it.
    pub rates_rad_s: Vector3<f32>,
}

/// Largest position that a state, pose or setpoint may hold, per coordinate \[m\].
pub(crate) const POSITION_MAX_M: f32 = 1e5;
/// Largest speed, per coordinate \[m/s\].
const VELOCITY_MAX_M_S: f32 = 1e3;
/// Largest acceleration of a setpoint, per coordinate \[m/s2\].
const ACCELERATION_MAX_M_S2: f32 = 1e3;
/// Largest jerk of a setpoint, per coordinate \[m/s3\]: of the largest acceleration on a circle of 0.06 s.
const JERK_MAX_M_S3: f32 = 1e5;
/// Largest snap of a setpoint, per coordinate \[m/s4\]: of that jerk on the same circle.
const SNAP_MAX_M_S4: f32 = 1e7;
/// Largest angle \[rad\]. Larger than a turn, because yaw may be unwrapped.
const ANGLE_MAX_RAD: f32 = 1e3;
/// Largest angular rate, per coordinate \[rad/s\].
const RATE_MAX_RAD_S: f32 = 1e3;
/// Largest heading and derivatives of it \[rad, rad/s, rad/s2\].
const HEADING_MAX: f32 = 1e3;

/// A number whose highest bit is set if a coordinate is larger than `max` in size or not a number.
fn excess(vector: &Vector3<f32>, max: f32) -> u32 {
    // The bits of positive numbers are in their order, those of NaN come last, and a difference below zero borrows the
    // highest bit: one branch for all of a state.
    let excess = vector.map(|value| max.to_bits().wrapping_sub(value.abs().to_bits()));
    excess.x | excess.y | excess.z
}

/// True if each vector is finite and within its bound, by coordinate.
#[inline]
pub(crate) fn within<const N: usize>(vectors: [(&Vector3<f32>, f32); N]) -> bool {
    vectors.into_iter().fold(0, |any, (vector, max)| any | excess(vector, max)) >> 31 == 0
}

impl State {
    /// True if every value is finite and physically possible: at most 1e5 m, 1e3 m/s, 1e3 rad and 1e3 rad/s in size.
    /// Controllers must reject any other state.
    pub fn is_plausible(&self) -> bool {
        within([
            (&self.position_m, POSITION_MAX_M),
            (&self.velocity_m_s, VELOCITY_MAX_M_S),
            (&self.attitude_rad, ANGLE_MAX_RAD),
            (&self.rates_rad_s, RATE_MAX_RAD_S),
        ])
    }
}

/// By how much an estimate has been set anew rather than corrected: not the vehicle has moved, but what is known of it.
/// A setpoint that is shifted by as much moves no vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ResetDelta {
    /// Position after less position before, earth frame \[m\].
    pub position_m: Vector3<f32>,
    /// Likewise the heading \[rad\].
    pub yaw_rad: f32,
}

/// Desired motion: \[x_d, y_d, z_d, psi_d\] with two derivatives (assumption A5), and two more of the position (not in
/// the paper) for laws that feed them forward. Unknown jerk and snap are zero, as from the link, whose messages carry
/// neither.
///
/// Fields may be added: a literal ends in `..Setpoint::default()`.
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
    /// Rate of the heading \[rad/s\].
    pub yaw_rate_rad_s: f32,
    /// Angular acceleration of the heading \[rad/s2\].
    pub yaw_acceleration_rad_s2: f32,
}

impl Setpoint {
    /// Returns the setpoint that holds the position and heading of `state`, at rest.
    pub fn hold(state: &State) -> Self {
        Setpoint { position_m: state.position_m, yaw_rad: state.attitude_rad.z, ..Setpoint::default() }
    }

    /// True if every value is finite and within the bounds of [`State::is_plausible`], accelerations at most 1e3 m/s2
    /// and 1e3 rad/s2, jerk at most 1e5 m/s3, snap at most 1e7 m/s4.
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

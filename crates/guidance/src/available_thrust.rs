//! Attitude and thrust targets as a setpoint. Position and velocity are the vehicle's own, and the acceleration is the
//! one that this attitude and thrust cause:
//!
//! ```text
//! a = R e3 T/m - g e3
//! ```
//!
//! Thus a law needs no input besides the setpoint. The law adds its learnt disturbances, such as wind; an
//! `AccelerationTrim` subtracts them.

use crate::settings::MotionLimits;
use afbc_control::math::{cos, max, min, sin, sqrt};
use afbc_types::{Setpoint, State};
use nalgebra::{Vector2, Vector3};

/// Time constant of the fastest approach to the limit of climb or sink rate \[s\].
const LIMIT_S: f32 = 0.25;
/// Smallest vertical thrust used for computing a tilt, as a share of the weight.
const VERTICAL_MIN: f32 = 0.2;
/// Time constants \[s\]: of the expected tilt, which models the law's response, and of the corrections of tilt and
/// thrust.
const FOLLOWS_S: f32 = 0.1;
const TILT_S: f32 = 0.3;
const THRUST_S: f32 = 0.2;
/// Share of the largest thrust above which the thrust counts as exhausted.
const EXHAUSTED_SHARE: f32 = 0.9;
/// Largest correction, horizontal and vertical \[m/s2\].
const TRIM_M_S2: f32 = 5.0;

/// Thrust that the rotors can give and have given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AvailableThrust {
    /// Largest thrust of all rotors, divided by the mass \[m/s2\].
    pub most_m_s2: f32,
    /// Acceleration of free fall \[m/s2\].
    pub gravity_m_s2: f32,
    /// Thrust commanded in the last tick, divided by the mass; none if the law did not fly \[m/s2\].
    pub given_m_s2: Option<f32>,
}

impl AvailableThrust {
    /// True if the rotors give nearly their largest thrust.
    pub(crate) fn is_exhausted(&self) -> bool {
        self.given_m_s2.is_some_and(|given_m_s2| given_m_s2 > EXHAUSTED_SHARE * self.most_m_s2)
    }

    /// Returns the setpoint of a vehicle in `state` with the thrust per mass `thrust_m_s2` along the unit vector `up`.
    pub(crate) fn setpoint(&self, state: &State, up: Vector3<f32>, thrust_m_s2: f32) -> Setpoint {
        // `clamp` panics if its lower end exceeds its upper end.
        let thrust_m_s2 = thrust_m_s2.clamp(0.0, self.most_m_s2.max(0.0));
        let acceleration_m_s2 = up * thrust_m_s2 - Vector3::new(0.0, 0.0, self.gravity_m_s2);
        Setpoint {
            position_m: state.position_m,
            velocity_m_s: state.velocity_m_s,
            acceleration_m_s2,
            ..Setpoint::hold(state)
        }
    }

    /// Returns a setpoint of attitude and thrust, with the thrust changed so that climb and sink rate stay within
    /// `limits`.
    pub(crate) fn limited(&self, setpoint: &Setpoint, state: &State, limits: &MotionLimits) -> Setpoint {
        let [[x, y, z]] = setpoint.acceleration_m_s2.data.0;
        let climb_m_s = state.velocity_m_s.z;
        let least_m_s2 = min((-limits.down_m_s - climb_m_s) / LIMIT_S, self.most_m_s2);
        let within_m_s2 = max(min(z, max((limits.up_m_s - climb_m_s) / LIMIT_S, least_m_s2)), least_m_s2);
        if within_m_s2 == z {
            return *setpoint;
        }
        let (was_m_s2, is_m_s2) = (z + self.gravity_m_s2, max(within_m_s2 + self.gravity_m_s2, 0.0));
        let share = is_m_s2 / max(was_m_s2, VERTICAL_MIN * self.gravity_m_s2);
        // Less thrust keeps the tilt. More thrust must not increase the horizontal acceleration beyond the target's.
        let lean_m_s2 = Vector2::new(x, y) * min(share, 1.0);
        let acceleration_m_s2 = Vector3::new(lean_m_s2.x, lean_m_s2.y, is_m_s2 - self.gravity_m_s2);
        Setpoint { acceleration_m_s2, ..*setpoint }
    }
}

/// Correction of the acceleration that makes the flown attitude and thrust match the target.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct AccelerationTrim {
    /// Tilt that the vehicle should have by now, as tangents; none at first.
    expected: Option<Vector2<f32>>,
    correction_m_s2: Vector3<f32>,
}

impl AccelerationTrim {
    /// Advances by one step, and returns `setpoint` with the correction added.
    pub(crate) fn advance(
        &mut self,
        lift: &AvailableThrust,
        state: &State,
        setpoint: &Setpoint,
        dt_s: f32,
    ) -> Setpoint {
        let thrust_m_s2 = setpoint.acceleration_m_s2 + Vector3::new(0.0, 0.0, lift.gravity_m_s2);
        let vertical_m_s2 = max(thrust_m_s2.z, VERTICAL_MIN * lift.gravity_m_s2);
        let wanted = thrust_m_s2.xy() / vertical_m_s2;
        let tilt = tilt(&state.attitude_rad);
        let before = self.expected.unwrap_or(tilt);
        let expected = before + (wanted - before) * min(dt_s / FOLLOWS_S, 1.0);
        self.expected = Some(expected);
        let [[x, y, z]] = self.correction_m_s2.data.0;
        let lean_m_s2 = Vector2::new(x, y) + (expected - tilt) * (vertical_m_s2 * dt_s / TILT_S);
        let square = lean_m_s2.norm_squared();
        let share = if square > TRIM_M_S2 * TRIM_M_S2 { TRIM_M_S2 / sqrt(square) } else { 1.0 };
        let lacks_m_s2 = lift.given_m_s2.map_or(0.0, |given_m_s2| sqrt(thrust_m_s2.norm_squared()) - given_m_s2);
        let upward_m_s2 = max(min(z + lacks_m_s2 * (dt_s / THRUST_S), TRIM_M_S2), -TRIM_M_S2);
        self.correction_m_s2 = Vector3::new(lean_m_s2.x * share, lean_m_s2.y * share, upward_m_s2);
        Setpoint { acceleration_m_s2: setpoint.acceleration_m_s2 + self.correction_m_s2, ..*setpoint }
    }
}

/// Returns the tangents of the tilt along earth x and y.
fn tilt(attitude_rad: &Vector3<f32>) -> Vector2<f32> {
    let [[roll, pitch, yaw]] = attitude_rad.data.0;
    let (forward, left) = (sin(pitch) * cos(roll), -sin(roll));
    let (s, c) = (sin(yaw), cos(yaw));
    Vector2::new(c * forward - s * left, s * forward + c * left) / max(cos(roll) * cos(pitch), VERTICAL_MIN)
}

#[cfg(test)]
mod tests;

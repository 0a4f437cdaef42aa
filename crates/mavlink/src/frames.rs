//! Conversion between the wire's frames and the frames of [`afbc_types`].
//!
//! The wire's earth frame is north-east-down (NED) or another local frame with z down; its body frame is
//! forward-right-down (FRD). The workspace uses north-west-up and forward-left-up. They differ by half a turn about x.
//! In either direction, y and z change their signs, both of a vector and of a quaternion's vector part.
//!
//! On both sides, an attitude q rotates from body to earth, so the signs of pitch and yaw change, too. Positive pitch
//! raises the nose on the wire and lowers it in the workspace, where it tilts the thrust forwards.

use afbc_types::State;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Converts a vector in either direction.
pub fn flip(vector: Vector3<f32>) -> Vector3<f32> {
    Vector3::new(vector.x, -vector.y, -vector.z)
}

/// Converts the quaternion w, x, y, z of an attitude in either direction.
pub fn flip_turn([w, x, y, z]: [f32; 4]) -> [f32; 4] {
    [w, x, -y, -z]
}

/// Content of ODOMETRY: position in the wire's earth frame, everything else in its body frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Odometry {
    /// Position x, y, z, NED \[m\].
    pub position_m: Vector3<f32>,
    /// Quaternion w, x, y, z from body to earth, of any nonzero norm.
    pub attitude: [f32; 4],
    /// Velocity in the body frame, which is the message's child frame \[m/s\].
    pub velocity_m_s: Vector3<f32>,
    /// Angular rates of the body, in the body frame \[rad/s\].
    pub rates_rad_s: Vector3<f32>,
}

impl Odometry {
    /// Returns the state in this project's frames. Returns `None` if the quaternion is no rotation or the state is not
    /// plausible ([`State::from_quaternion`]).
    pub fn to_state(&self) -> Option<State> {
        let [w, x, y, z] = self.attitude;
        let attitude = Quaternion::new(w, x, -y, -z);
        // A zero quaternion gives NaN, which is refused below.
        let velocity_m_s = UnitQuaternion::new_normalize(attitude) * flip(self.velocity_m_s);
        State::from_quaternion(flip(self.position_m), velocity_m_s, &attitude, flip(self.rates_rad_s))
    }

    /// Converts `state` to the wire's frames.
    pub fn from_state(state: &State) -> Self {
        let attitude = state.quaternion();
        Odometry {
            position_m: flip(state.position_m),
            attitude: [attitude.w, attitude.i, -attitude.j, -attitude.k],
            velocity_m_s: flip(attitude.inverse() * state.velocity_m_s),
            rates_rad_s: flip(state.rates_rad_s),
        }
    }
}

//! Conversion between the wire's frames and those of [`afbc_types`].
//!
//! The wire's earth frame is north-east-down (NED) or any other local frame with z down, its body frame
//! forward-right-down (FRD). The workspace's frames are north-west-up and forward-left-up. Each is the other turned by
//! half a turn about x: y and z of a vector, and of a quaternion's vector part, change their signs in either direction.
//!
//! An attitude q turns body coordinates into earth coordinates on both sides, so the signs of pitch and yaw change as
//! well: positive pitch on the wire lifts the nose and tilts the thrust backwards, in the workspace forwards.

use afbc_types::State;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Converts a vector from either side to the other.
pub fn flip(vector: Vector3<f32>) -> Vector3<f32> {
    Vector3::new(vector.x, -vector.y, -vector.z)
}

/// Converts the quaternion w, x, y, z of an attitude from either side to the other.
pub fn flip_turn([w, x, y, z]: [f32; 4]) -> [f32; 4] {
    [w, x, -y, -z]
}

/// Content of ODOMETRY: position in the wire's earth frame, the rest of the motion in its body frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Odometry {
    /// Position x, y, z, NED \[m\].
    pub position_m: Vector3<f32>,
    /// Quaternion w, x, y, z from body to earth, of any norm but zero.
    pub attitude: [f32; 4],
    /// Velocity in the body frame, the message's child frame \[m/s\].
    pub velocity_m_s: Vector3<f32>,
    /// Angular rates of the body, in the body frame \[rad/s\].
    pub rates_rad_s: Vector3<f32>,
}

impl Odometry {
    /// Returns the state in this project's frames; `None` if the quaternion is not a rotation or the state is not
    /// plausible ([`State::from_quaternion`]).
    pub fn to_state(&self) -> Option<State> {
        let [w, x, y, z] = self.attitude;
        let attitude = Quaternion::new(w, x, -y, -z);
        // Of a quaternion of zeros this is not a number; it is refused below.
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

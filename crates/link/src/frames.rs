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

/// Accepted deviation of a quaternion's squared norm from 1.
const NORM_SQUARED_ERROR_MAX: f32 = 0.1;

impl Odometry {
    /// Returns the state in the workspace's frames, yaw within \[-pi, pi\]. `None` if the quaternion is no rotation
    /// (its squared norm is not within 0.9 to 1.1) or the state is not plausible ([`State::is_plausible`]).
    pub fn to_state(&self) -> Option<State> {
        let [w, x, y, z] = self.attitude;
        let attitude = Quaternion::new(w, x, -y, -z);
        let rotation = (attitude.norm_squared() - 1.0).abs() <= NORM_SQUARED_ERROR_MAX;
        let r_earth_body = UnitQuaternion::new_normalize(attitude);
        let state = State {
            position_m: flip(self.position_m),
            velocity_m_s: r_earth_body * flip(self.velocity_m_s),
            attitude_rad: euler(&attitude),
            rates_rad_s: flip(self.rates_rad_s),
        };
        // A NaN makes `rotation` false.
        (rotation && state.is_plausible()).then_some(state)
    }

    /// Converts `state` to the wire's frames.
    pub fn from_state(state: &State) -> Self {
        let attitude = quaternion(&state.attitude_rad);
        Odometry {
            position_m: flip(state.position_m),
            attitude: [attitude.w, attitude.i, -attitude.j, -attitude.k],
            velocity_m_s: flip(attitude.inverse() * state.velocity_m_s),
            rates_rad_s: flip(state.rates_rad_s),
        }
    }
}

/// Returns roll, pitch and yaw \[rad\] of the z-y-x sequence for a quaternion from body to earth coordinates, of any
/// norm but zero. Roll and yaw are within \[-pi, pi\], pitch within \[-pi/2, pi/2\].
///
/// In half angles, with c and s the cosine and sine of half the pitch,
///
/// ```text
/// w - y = (c - s) cos((roll + yaw)/2)      w + y = (c + s) cos((roll - yaw)/2)
/// x + z = (c - s) sin((roll + yaw)/2)      x - z = (c + s) sin((roll - yaw)/2)
/// ```
///
/// so accuracy does not depend on pitch; at +-90 degrees, where only a sum of roll and yaw is defined, the result is
/// still a
/// valid decomposition.
/// Bernardes and Viollet, *Quaternion to Euler angles conversion*, PLoS ONE 17(11), 2022.
pub fn euler(attitude: &Quaternion<f32>) -> Vector3<f32> {
    use core::f32::consts::FRAC_PI_2;
    let (w, x, y, z) = (attitude.w, attitude.i, attitude.j, attitude.k);
    let half_sum = libm::atan2f(x + z, w - y);
    let half_difference = libm::atan2f(x - z, w + y);
    let length = |a: f32, b: f32| libm::sqrtf(a * a + b * b);
    let pitch = 2.0 * libm::atan2f(length(w + y, x - z), length(w - y, x + z)) - FRAC_PI_2;
    Vector3::new(wrap(half_sum + half_difference), pitch, wrap(half_sum - half_difference))
}

/// Returns the unit quaternion from body to earth coordinates for roll, pitch and yaw \[rad\] of the z-y-x sequence.
pub fn quaternion(attitude_rad: &Vector3<f32>) -> UnitQuaternion<f32> {
    let half = attitude_rad.map(|angle| libm::sincosf(0.5 * angle));
    let ((sx, cx), (sy, cy), (sz, cz)) = (half.x, half.y, half.z);
    UnitQuaternion::new_normalize(Quaternion::new(
        cx * cy * cz + sx * sy * sz,
        sx * cy * cz - cx * sy * sz,
        cx * sy * cz + sx * cy * sz,
        cx * cy * sz - sx * sy * cz,
    ))
}

/// Wraps an angle within two turns of zero to within half a turn.
fn wrap(angle: f32) -> f32 {
    use core::f32::consts::{PI, TAU};
    if angle > PI {
        angle - TAU
    } else if angle < -PI {
        angle + TAU
    } else {
        angle
    }
}

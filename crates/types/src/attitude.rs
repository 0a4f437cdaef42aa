//! Attitudes as quaternions and as Euler angles. An attitude turns body coordinates into earth coordinates.

use crate::{State, sin_cos};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Accepted deviation of a quaternion's squared norm from 1.
const NORM_SQUARED_ERROR_MAX: f32 = 0.1;

impl State {
    /// Returns the state of a vehicle whose attitude is given as a quaternion from body (FLU) to earth (z up)
    /// coordinates. Position and velocity are in the earth frame, rates in the body frame, as in the crate's
    /// [conventions](crate). Yaw is within \[-pi, pi\]. Returns `None` if the quaternion is not a rotation (squared
    /// norm not within 0.9 to 1.1), or if the state is not plausible ([`State::is_plausible`]).
    ///
    /// ```
    /// use afbc_types::State;
    /// use afbc_types::nalgebra::{Quaternion, Vector3};
    ///
    /// // w, x, y, z: 90 degrees to the left.
    /// let (position_m, zero) = (Vector3::new(0.0, 0.0, 2.0), Vector3::zeros());
    /// let state = State::from_quaternion(position_m, zero, &Quaternion::new(0.7071, 0.0, 0.0, 0.7071), zero).unwrap();
    /// assert!((state.attitude_rad.z - 1.5708).abs() < 1e-4);
    /// assert!((state.quaternion().w - 0.7071).abs() < 1e-4);
    /// ```
    pub fn from_quaternion(
        position_m: Vector3<f32>,
        velocity_m_s: Vector3<f32>,
        attitude: &Quaternion<f32>,
        rates_rad_s: Vector3<f32>,
    ) -> Option<Self> {
        let attitude_rad = euler_angles(attitude, libm::atan2f, libm::sqrtf);
        let state = State { position_m, velocity_m_s, attitude_rad, rates_rad_s };
        (is_rotation(attitude) && state.is_plausible()).then_some(state)
    }

    /// Returns the attitude as a unit quaternion from body to earth coordinates. Its sign may be either.
    pub fn quaternion(&self) -> UnitQuaternion<f32> {
        let half = self.attitude_rad.map(|angle| sin_cos(0.5 * angle));
        let ((sx, cx), (sy, cy), (sz, cz)) = (half.x, half.y, half.z);
        // Normalise, since rounded sines and cosines give a length that is only nearly 1.
        UnitQuaternion::new_normalize(Quaternion::new(
            cx * cy * cz + sx * sy * sz,
            sx * cy * cz - cx * sy * sz,
            cx * sy * cz + sx * cy * sz,
            cx * cy * sz - sx * sy * cz,
        ))
    }
}

/// True if a quaternion's squared norm is within 0.9 to 1.1.
pub(crate) fn is_rotation(attitude: &Quaternion<f32>) -> bool {
    // The comparison is false for NaN.
    (attitude.norm_squared() - 1.0).abs() <= NORM_SQUARED_ERROR_MAX
}

/// Returns roll, pitch and yaw \[rad\] of the z-y-x sequence for a quaternion of any norm except zero. Roll and yaw are
/// within \[-pi, pi\], pitch within \[-pi/2, pi/2\]. The caller provides the arctangent (of y, x) and the square root.
///
/// In half angles, with c and s the cosine and sine of half the pitch,
///
/// ```text
/// w - y = (c - s) cos((roll + yaw)/2)      w + y = (c + s) cos((roll - yaw)/2)
/// x + z = (c - s) sin((roll + yaw)/2)      x - z = (c + s) sin((roll - yaw)/2)
/// ```
///
/// so the accuracy does not depend on the pitch. At +-90 degrees, where only a sum of roll and yaw is defined, the
/// result is still a valid decomposition. Bernardes and Viollet, *Quaternion to Euler angles conversion*, PLoS ONE
/// 17(11), 2022.
#[inline]
pub fn euler_angles(
    attitude: &Quaternion<f32>,
    atan2: impl Fn(f32, f32) -> f32,
    sqrt: impl Fn(f32) -> f32,
) -> Vector3<f32> {
    use core::f32::consts::FRAC_PI_2;
    let (w, x, y, z) = (attitude.w, attitude.i, attitude.j, attitude.k);
    let half_sum = atan2(x + z, w - y);
    let half_difference = atan2(x - z, w + y);
    let length = |a: f32, b: f32| sqrt(a * a + b * b);
    let pitch = 2.0 * atan2(length(w + y, x - z), length(w - y, x + z)) - FRAC_PI_2;
    Vector3::new(wrap(half_sum + half_difference), pitch, wrap(half_sum - half_difference))
}

/// Wraps an angle between -3 pi and 3 pi to \[-pi, pi\].
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

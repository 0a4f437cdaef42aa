//! Attitudes as rotation matrices, and attitude errors.
//!
//! A matrix R rotates body coordinates to earth coordinates; its third column is the direction of the thrust. An error
//! is a small rotation in body coordinates \[rad\], positive where the body must rotate positively to reach the desired
//! attitude.

use afbc_control::math;
use nalgebra::{Matrix3, Quaternion, Vector3};

/// Two thrust directions count as opposite if cos(tilt error / 2) squared is below this.
const OPPOSITE: f32 = 1e-6;

/// Returns R = Rz(psi) Ry(theta) Rx(phi) for eta = \[phi, theta, psi\] \[rad\].
#[inline]
pub fn r_earth_body(attitude_rad: &Vector3<f32>) -> Matrix3<f32> {
    let (s_phi, c_phi) = (math::sin(attitude_rad.x), math::cos(attitude_rad.x));
    let (s_theta, c_theta) = (math::sin(attitude_rad.y), math::cos(attitude_rad.y));
    let (s_psi, c_psi) = (math::sin(attitude_rad.z), math::cos(attitude_rad.z));
    Matrix3::new(
        c_psi * c_theta,
        c_psi * s_theta * s_phi - s_psi * c_phi,
        c_psi * s_theta * c_phi + s_psi * s_phi,
        s_psi * c_theta,
        s_psi * s_theta * s_phi + c_psi * c_phi,
        s_psi * s_theta * c_phi - c_psi * s_phi,
        -s_theta,
        c_theta * s_phi,
        c_theta * c_phi,
    )
}

/// Returns the horizontal unit vectors along a heading and to its left.
#[inline]
pub(crate) fn heading(yaw_rad: f32) -> [Vector3<f32>; 2] {
    let (s, c) = (math::sin(yaw_rad), math::cos(yaw_rad));
    [Vector3::new(c, s, 0.0), Vector3::new(-s, c, 0.0)]
}

/// Returns the length of `v`.
#[inline]
pub(crate) fn length(v: &Vector3<f32>) -> f32 {
    math::sqrt(v.dot(v))
}

/// Returns `v` scaled to length 1; `v` must not be 0.
#[inline]
pub(crate) fn unit(v: &Vector3<f32>) -> Vector3<f32> {
    v * (1.0 / length(v))
}

/// Returns the attitude with its thrust along `thrust` (any length, above the horizon) and the Euler yaw `yaw_rad`.
/// Body x is perpendicular to the thrust and to the horizontal vector left of the heading.
#[inline]
pub fn facing(thrust: &Vector3<f32>, yaw_rad: f32) -> Matrix3<f32> {
    let [_, left] = heading(yaw_rad);
    let z = unit(thrust);
    // `left` is level and `z` is not, so they are never parallel.
    let x = unit(&left.cross(&z));
    Matrix3::from_columns(&[x, z.cross(&x), z])
}

/// Returns roll and pitch of an attitude that is not upside down \[rad\].
#[inline]
pub fn roll_pitch(r: &Matrix3<f32>) -> [f32; 2] {
    let cos_theta = math::sqrt(r.m32 * r.m32 + r.m33 * r.m33);
    [math::atan(r.m32 / r.m33), math::atan(-r.m31 / cos_theta)]
}

/// Returns the quaternion of a rotation matrix, with a non-negative real part. Shepperd's method (1978) divides by the
/// largest of the four parts, so never by a small number.
#[inline]
pub fn quaternion(r: &Matrix3<f32>) -> Quaternion<f32> {
    // These are four times the squares of the parts. Their sum is 4.
    let (w, x) = (1.0 + r.m11 + r.m22 + r.m33, 1.0 + r.m11 - r.m22 - r.m33);
    let (y, z) = (1.0 - r.m11 + r.m22 - r.m33, 1.0 - r.m11 - r.m22 + r.m33);
    // These are four times the products of pairs of parts.
    let (wx, wy, wz) = (r.m32 - r.m23, r.m13 - r.m31, r.m21 - r.m12);
    let (xy, yz, xz) = (r.m12 + r.m21, r.m23 + r.m32, r.m13 + r.m31);
    let scaled = if w >= x && w >= y && w >= z {
        Quaternion::new(w, wx, wy, wz)
    } else if x >= y && x >= z {
        Quaternion::new(wx, x, xy, xz)
    } else if y >= z {
        Quaternion::new(wy, xy, y, yz)
    } else {
        Quaternion::new(wz, xz, yz, z)
    };
    let length = math::sqrt(scaled.coords.dot(&scaled.coords));
    scaled * (if scaled.w < 0.0 { -1.0 } else { 1.0 } / length)
}

/// Returns the attitude error \[rad\] that turns the thrust the shortest way and corrects only the share `yaw_weight`
/// (0 to 1) of the yaw error. For small errors it is the rotation vector with its third part times `yaw_weight`.
///
/// With q = \[q0, q1, q2, q3\] from the body to the desired attitude, split as q = q_tilt q_yaw (Brescianini and
/// D'Andrea, *Tilt-prioritized quadrocopter attitude control*, IEEE TCST 28(2), 2020):
///
/// ```text
/// n = sqrt(q0^2 + q3^2)
/// q_tilt = [n, (q0 q1 - q2 q3) / n, (q0 q2 + q1 q3) / n, 0]
/// q_yaw  = [q0, 0, 0, q3] / n = [cos a, 0, 0, sin a]
/// e = 2 Im(q_tilt [cos(w a), 0, 0, sin(w a)])
/// ```
#[inline]
pub fn tilt_prioritised_error(r: &Matrix3<f32>, desired: &Matrix3<f32>, yaw_weight: f32) -> Vector3<f32> {
    let q = quaternion(&(r.transpose() * desired));
    let weighted = tilt(&q).map_or(q, |(tilt, _)| {
        // q.w may be 0, but not together with q.k: atan of infinity is pi/2.
        let half_yaw = yaw_weight * math::atan(q.k / q.w);
        tilt * Quaternion::new(math::cos(half_yaw), 0.0, 0.0, math::sin(half_yaw))
    });
    weighted.imag() * 2.0
}

/// Returns the attitude error in two parts, the tilt's in x and y, the yaw's in z \[rad\]: 2 Im(q_tilt) + 2 Im(q_yaw).
#[inline]
pub fn tilt_and_yaw_error(r: &Matrix3<f32>, desired: &Matrix3<f32>) -> Vector3<f32> {
    let q = quaternion(&(r.transpose() * desired));
    let parts = tilt(&q).map_or(q.imag(), |(tilt, per_n)| Vector3::new(tilt.i, tilt.j, q.k * per_n));
    parts * 2.0
}

/// Returns q_tilt and 1/n. `None` for opposite thrusts, where all ways round are equally short and yaw is undefined.
#[inline]
fn tilt(q: &Quaternion<f32>) -> Option<(Quaternion<f32>, f32)> {
    let n_squared = q.w * q.w + q.k * q.k;
    if n_squared < OPPOSITE {
        return None;
    }
    let inverse = 1.0 / math::sqrt(n_squared);
    let [i, j] = [(q.w * q.i - q.j * q.k) * inverse, (q.w * q.j + q.i * q.k) * inverse];
    Some((Quaternion::new(n_squared * inverse, i, j, 0.0), inverse))
}

/// Returns -e_R of Lee, Leok and McClamroch: half the vector of R' R_d - R_d' R. Its length is the sine of the angle
/// between both attitudes.
#[inline]
pub fn geometric_error(r: &Matrix3<f32>, desired: &Matrix3<f32>) -> Vector3<f32> {
    let q = r.transpose() * desired;
    Vector3::new(q.m32 - q.m23, q.m13 - q.m31, q.m21 - q.m12) * 0.5
}

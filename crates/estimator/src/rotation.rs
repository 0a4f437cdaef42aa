//! Rotations: the few operations on quaternions and angles that the filter needs, short and without the platform's
//! library. A quaternion turns body coordinates into earth coordinates; products are Hamilton's.

use afbc_control::math::{atan, sqrt};
use nalgebra::{Matrix3, Quaternion, Vector3};

/// No rotation.
pub(crate) fn identity() -> Quaternion<f32> {
    Quaternion::new(1.0, 0.0, 0.0, 0.0)
}

/// Rotation by a vector \[rad\], by the series of sine and cosine up to the fourth order of half the angle; 1e-7 at
/// 0.35 rad. Of unit norm for any vector.
#[inline]
pub(crate) fn small(turn_rad: &Vector3<f32>) -> Quaternion<f32> {
    let square = 0.25 * turn_rad.norm_squared();
    if square > 0.03 {
        return large(turn_rad, square);
    }
    let scale = 0.5 * (1.0 - square * (1.0 / 6.0 - square * (1.0 / 120.0)));
    let w = 1.0 - square * (0.5 - square * (1.0 / 24.0));
    Quaternion::new(w, scale * turn_rad.x, scale * turn_rad.y, scale * turn_rad.z)
}

/// The same for large angles, with the square of half the angle.
#[cold]
#[inline(never)]
fn large(turn_rad: &Vector3<f32>, square: f32) -> Quaternion<f32> {
    let half = sqrt(square);
    let (sine, cosine) = afbc_types::sin_cos(afbc_control::math::wrap_angle(half));
    let scale = 0.5 * sine / half;
    Quaternion::new(cosine, scale * turn_rad.x, scale * turn_rad.y, scale * turn_rad.z)
}

/// Rotation by an angle about the earth's z, of the right norm to `f32` precision.
pub(crate) fn about_z(angle_rad: f32) -> Quaternion<f32> {
    let (sine, cosine) = afbc_types::sin_cos(0.5 * angle_rad);
    Quaternion::new(cosine, 0.0, 0.0, sine)
}

/// Shortest rotation that turns the unit vector `up`, in the body, to the earth's z; none if it points down.
pub(crate) fn levelling(up: &Vector3<f32>) -> Option<Quaternion<f32>> {
    // Upside down every axis would do, and the norm would vanish. False of NaN.
    (up.z > -0.99).then(|| normalized(&Quaternion::new(1.0 + up.z, up.y, -up.x, 0.0)))
}

/// The quaternion at norm 1.
pub(crate) fn normalized(q: &Quaternion<f32>) -> Quaternion<f32> {
    q * (1.0 / sqrt(q.norm_squared()))
}

/// The quaternion at norm 1, if it is nearly there already: one step of Newton's method.
pub(crate) fn renormalized(q: &Quaternion<f32>) -> Quaternion<f32> {
    q * (1.5 - 0.5 * q.norm_squared())
}

/// Matrix of a unit quaternion.
pub(crate) fn matrix(q: &Quaternion<f32>) -> Matrix3<f32> {
    let (x2, y2, z2) = (2.0 * q.i, 2.0 * q.j, 2.0 * q.k);
    let (xx, yy, zz) = (x2 * q.i, y2 * q.j, z2 * q.k);
    let (xy, xz, yz) = (x2 * q.j, x2 * q.k, y2 * q.k);
    let (wx, wy, wz) = (x2 * q.w, y2 * q.w, z2 * q.w);
    Matrix3::new(
        1.0 - (yy + zz),
        xy - wz,
        xz + wy,
        xy + wz,
        1.0 - (xx + zz),
        yz - wx,
        xz - wy,
        yz + wx,
        1.0 - (xx + yy),
    )
}

/// Vector of the rotation \[rad\] from `from` to `to` in the earth frame: to = small(v) from. Exact for small angles,
/// and of the right direction up to half a turn.
pub(crate) fn difference(to: &Quaternion<f32>, from: &Quaternion<f32>) -> Vector3<f32> {
    let q = to * from.conjugate();
    let vector = q.imag();
    let sine = sqrt(vector.norm_squared());
    // The angle per unit of the vector, 2 for small ones.
    let scale = if sine < 0.05 { 2.0 + sine * sine * (1.0 / 3.0) } else { 2.0 * atan2(sine, q.w.abs()) / sine };
    // q and -q are one rotation: the sign of w chooses the one of at most half a turn.
    vector * if q.w < 0.0 { -scale } else { scale }
}

/// Angle of the rotation from `from` to `to` about the earth's z, the rest aside \[rad\], within \[-pi, pi\].
pub(crate) fn twist(to: &Quaternion<f32>, from: &Quaternion<f32>) -> f32 {
    let q = to * from.conjugate();
    afbc_control::math::wrap_angle(2.0 * atan2(q.k, q.w))
}

/// Angle of the vector (x, y) from the x axis \[rad\], within \[-pi, pi\]; 0 for the zero vector.
pub(crate) fn atan2(y: f32, x: f32) -> f32 {
    use core::f32::consts::{FRAC_PI_2, PI};
    if x == 0.0 && y == 0.0 {
        return 0.0;
    }
    // The smaller over the larger: an argument of at most 1, and no division by zero.
    if y.abs() > x.abs() {
        return FRAC_PI_2.copysign(y) - atan(x / y);
    }
    let angle = atan(y / x);
    if x > 0.0 { angle } else { angle + PI.copysign(y) }
}

/// Roll, pitch and yaw of a unit quaternion \[rad\], by this crate's arctangent, which is quicker than libm's.
pub(crate) fn euler(q: &Quaternion<f32>) -> Vector3<f32> {
    afbc_types::euler_angles(q, atan2, sqrt)
}

//! The few rotation operations that the filter needs, short and without libm. A quaternion rotates body coordinates to
//! earth coordinates; products are Hamilton's.

use afbc_control::math::{atan, sqrt};
use nalgebra::{Matrix3, Quaternion, Vector3};

/// Returns the identity rotation.
pub(crate) fn identity() -> Quaternion<f32> {
    Quaternion::new(1.0, 0.0, 0.0, 0.0)
}

/// Returns the unit quaternion of a rotation vector \[rad\], by series up to the fourth order of half the angle. The
/// error is 1e-7 at 0.35 rad; larger angles use sine and cosine.
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

/// Returns the same rotation for large angles; `square` is the square of half the angle.
#[cold]
#[inline(never)]
fn large(turn_rad: &Vector3<f32>, square: f32) -> Quaternion<f32> {
    let half = sqrt(square);
    let (sine, cosine) = afbc_types::sin_cos(afbc_control::math::wrap_angle(half));
    let scale = 0.5 * sine / half;
    Quaternion::new(cosine, scale * turn_rad.x, scale * turn_rad.y, scale * turn_rad.z)
}

/// Returns the rotation by an angle about the earth's z, with norm 1 to `f32` precision.
pub(crate) fn about_z(angle_rad: f32) -> Quaternion<f32> {
    let (sine, cosine) = afbc_types::sin_cos(0.5 * angle_rad);
    Quaternion::new(cosine, 0.0, 0.0, sine)
}

/// Returns the shortest rotation of the body's unit vector `up` to the earth's z, `None` if it points down.
pub(crate) fn levelling(up: &Vector3<f32>) -> Option<Quaternion<f32>> {
    // If `up` points down, every horizontal axis is a solution and the norm is zero. NaN returns `None`.
    (up.z > -0.99).then(|| normalized(&Quaternion::new(1.0 + up.z, up.y, -up.x, 0.0)))
}

/// Returns the quaternion scaled to norm 1.
pub(crate) fn normalized(q: &Quaternion<f32>) -> Quaternion<f32> {
    q * (1.0 / sqrt(q.norm_squared()))
}

/// Returns the quaternion scaled to norm 1, if its norm is already close: one step of Newton's method.
pub(crate) fn renormalized(q: &Quaternion<f32>) -> Quaternion<f32> {
    q * (1.5 - 0.5 * q.norm_squared())
}

/// Returns the matrix of a unit quaternion.
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

/// Returns the rotation vector \[rad\] from `from` to `to` in the earth frame: to = small(v) from. It is exact
/// for small angles, and its direction is right up to half a turn.
pub(crate) fn difference(to: &Quaternion<f32>, from: &Quaternion<f32>) -> Vector3<f32> {
    let q = to * from.conjugate();
    let vector = q.imag();
    let sine = sqrt(vector.norm_squared());
    // Angle divided by the vector's length, 2 for small angles.
    let scale = if sine < 0.05 { 2.0 + sine * sine * (1.0 / 3.0) } else { 2.0 * atan2(sine, q.w.abs()) / sine };
    // q and -q are the same rotation. With w >= 0, its angle is at most half a turn.
    vector * if q.w < 0.0 { -scale } else { scale }
}

/// Returns the angle of the rotation from `from` to `to` about the earth's z, ignoring the tilt \[rad\], within \[-pi,
/// pi\].
pub(crate) fn yaw_between(to: &Quaternion<f32>, from: &Quaternion<f32>) -> f32 {
    let q = to * from.conjugate();
    afbc_control::math::wrap_angle(2.0 * atan2(q.k, q.w))
}

/// Returns the angle of the vector (x, y) from the x axis \[rad\], within \[-pi, pi\]; 0 for the zero vector.
pub(crate) fn atan2(y: f32, x: f32) -> f32 {
    use core::f32::consts::{FRAC_PI_2, PI};
    if x == 0.0 && y == 0.0 {
        return 0.0;
    }
    // Dividing the smaller by the larger keeps the argument within 1 and avoids a division by zero.
    if y.abs() > x.abs() {
        return FRAC_PI_2.copysign(y) - atan(x / y);
    }
    let angle = atan(y / x);
    if x > 0.0 { angle } else { angle + PI.copysign(y) }
}

/// Returns roll, pitch and yaw of a unit quaternion \[rad\], with this crate's arctangent, which is faster than libm's.
pub(crate) fn euler(q: &Quaternion<f32>) -> Vector3<f32> {
    afbc_types::euler_angles(q, atan2, sqrt)
}

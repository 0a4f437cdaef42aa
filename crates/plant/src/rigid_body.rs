//! Full rigid body, (1)-(5) as corrected, with a unit quaternion as attitude and so without singularities.

use crate::body_axes::BodyAxes;
use crate::load::Load;
use crate::motion::Motion;
use crate::surroundings::AirAndGround;
use libm::{asin, atan2, cos, sin, sqrt};
use nalgebra::{SVector, Vector3};

/// State vector: \[x, y, z, their rates, quaternion w x y z (body to earth), p, q, r\].
pub type RigidBodyVector = SVector<f64, 13>;

/// Returns the unit quaternion w, x, y, z (body to earth) of roll, pitch and yaw.
pub(crate) fn quaternion(attitude_rad: &Vector3<f64>) -> [f64; 4] {
    let half = attitude_rad * 0.5;
    let (s_phi, c_phi) = (sin(half.x), cos(half.x));
    let (s_theta, c_theta) = (sin(half.y), cos(half.y));
    let (s_psi, c_psi) = (sin(half.z), cos(half.z));
    [
        c_psi * c_theta * c_phi + s_psi * s_theta * s_phi,
        c_psi * c_theta * s_phi - s_psi * s_theta * c_phi,
        c_psi * s_theta * c_phi + s_psi * c_theta * s_phi,
        s_psi * c_theta * c_phi - c_psi * s_theta * s_phi,
    ]
}

/// Converts `motion` to the state vector.
pub fn vector(motion: &Motion) -> RigidBodyVector {
    let mut x = RigidBodyVector::zeros();
    x.fixed_rows_mut::<3>(0).copy_from(&motion.position_m);
    x.fixed_rows_mut::<3>(3).copy_from(&motion.velocity_m_s);
    x.fixed_rows_mut::<4>(6).copy_from_slice(&quaternion(&motion.attitude_rad));
    x.fixed_rows_mut::<3>(10).copy_from(&motion.rates_rad_s);
    x
}

/// Converts a state vector to the motion, with yaw and roll within -pi to pi and pitch within -pi/2 to pi/2.
#[inline]
pub fn motion(v: &RigidBodyVector) -> Motion {
    let (w, x, y, z) = (v[6], v[7], v[8], v[9]);
    Motion {
        position_m: v.fixed_rows::<3>(0).into(),
        velocity_m_s: v.fixed_rows::<3>(3).into(),
        attitude_rad: Vector3::new(
            atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
            // Rounding may take the sine just beyond 1, where the arcsine is NaN.
            asin((2.0 * (w * y - x * z)).clamp(-1.0, 1.0)),
            atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
        ),
        rates_rad_s: v.fixed_rows::<3>(10).into(),
    }
}

/// Returns d eta/dt = N(eta)^-1 Omega (1), as corrected. Singular at a pitch of 90 degrees.
pub fn euler_rates(attitude_rad: &Vector3<f64>, rates_rad_s: &Vector3<f64>) -> Vector3<f64> {
    let (phi, theta) = (attitude_rad.x, attitude_rad.y);
    let (p, q, r) = (rates_rad_s.x, rates_rad_s.y, rates_rad_s.z);
    let across = sin(phi) * q + cos(phi) * r;
    let psi_dot = across / cos(theta);
    Vector3::new(p + psi_dot * sin(theta), cos(phi) * q - sin(phi) * r, psi_dot)
}

/// Returns the derivative of the state vector with a constant load.
#[inline]
pub fn derivative(v: &RigidBodyVector, load: &Load) -> RigidBodyVector {
    pack(v, &load.acceleration(&body_axes(v).up), &load.angular_acceleration(&Vector3::new(v[10], v[11], v[12])))
}

/// Returns the derivative of the state vector from its accelerations.
#[inline]
fn pack(v: &RigidBodyVector, acceleration: &Vector3<f64>, angular_acceleration: &Vector3<f64>) -> RigidBodyVector {
    let (w, x, y, z) = (v[6], v[7], v[8], v[9]);
    let (p, q, r) = (v[10], v[11], v[12]);
    RigidBodyVector::from([
        v[3],
        v[4],
        v[5],
        acceleration.x,
        acceleration.y,
        acceleration.z,
        // Half of the quaternion's product with [0, Omega].
        0.5 * (-x * p - y * q - z * r),
        0.5 * (w * p + y * r - z * q),
        0.5 * (w * q - x * r + z * p),
        0.5 * (w * r + x * q - y * p),
        angular_acceleration.x,
        angular_acceleration.y,
        angular_acceleration.z,
    ])
}

/// Returns the body axes from the unit quaternion.
#[inline]
pub(crate) fn body_axes(v: &RigidBodyVector) -> BodyAxes {
    BodyAxes::of_quaternion(v[6], v[7], v[8], v[9])
}

/// Returns [`derivative`] with the forces that depend on position and velocity.
// This function is always inlined, with its callees: passing a state through memory costs a fifth of this function's
// time.
#[inline(always)]
pub(crate) fn derivative_in(v: &RigidBodyVector, load: &Load, surroundings: &AirAndGround) -> RigidBodyVector {
    let (velocity, rates) = (Vector3::new(v[3], v[4], v[5]), Vector3::new(v[10], v[11], v[12]));
    let axes = body_axes(v);
    let (a, angular) = surroundings.accelerations(v[2], &velocity, &axes, &rates);
    pack(v, &(a + load.acceleration(&axes.up)), &(angular + load.angular_acceleration(&rates)))
}

/// Normalises the quaternion, whose length drifts slowly in the integration.
#[inline]
pub(crate) fn normalise(v: &mut RigidBodyVector) {
    let (w, x, y, z) = (v[6], v[7], v[8], v[9]);
    let scale = 1.0 / sqrt(w * w + x * x + y * y + z * z);
    v[6] *= scale;
    v[7] *= scale;
    v[8] *= scale;
    v[9] *= scale;
}

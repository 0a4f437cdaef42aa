//! The paper's simplified model (6), with d eta/dt in place of Omega.

use crate::body_axes::BodyAxes;
use crate::load::Load;
use crate::motion::Motion;
use crate::surroundings::AirAndGround;
use libm::{cos, sin};
use nalgebra::{SVector, Vector3};

/// State vector: \[x, y, z, their rates, phi, theta, psi, their rates\].
pub type SimplifiedVector = SVector<f64, 12>;

/// Converts `motion` to the state vector.
pub fn vector(motion: &Motion) -> SimplifiedVector {
    let mut x = SimplifiedVector::zeros();
    x.fixed_rows_mut::<3>(0).copy_from(&motion.position_m);
    x.fixed_rows_mut::<3>(3).copy_from(&motion.velocity_m_s);
    x.fixed_rows_mut::<3>(6).copy_from(&motion.attitude_rad);
    x.fixed_rows_mut::<3>(9).copy_from(&motion.rates_rad_s);
    x
}

/// Converts a state vector to the motion.
pub fn motion(x: &SimplifiedVector) -> Motion {
    Motion {
        position_m: x.fixed_rows::<3>(0).into(),
        velocity_m_s: x.fixed_rows::<3>(3).into(),
        attitude_rad: x.fixed_rows::<3>(6).into(),
        rates_rad_s: x.fixed_rows::<3>(9).into(),
    }
}

/// Returns f(X) of (6) with a constant load.
#[inline]
pub fn derivative(x: &SimplifiedVector, load: &Load) -> SimplifiedVector {
    let Motion { velocity_m_s, rates_rad_s: eta_dot, .. } = motion(x);
    let mut x_dot = SimplifiedVector::zeros();
    x_dot.fixed_rows_mut::<3>(0).copy_from(&velocity_m_s);
    x_dot.fixed_rows_mut::<3>(3).copy_from(&load.acceleration(&body_axes(x).up));
    x_dot.fixed_rows_mut::<3>(6).copy_from(&eta_dot);
    x_dot.fixed_rows_mut::<3>(9).copy_from(&load.angular_acceleration(&eta_dot));
    x_dot
}

/// Returns Omega = N(eta) d eta/dt and its derivative, from eta and its two derivatives.
pub(crate) fn body_rates(
    eta: &Vector3<f64>,
    eta_dot: &Vector3<f64>,
    eta_dot_dot: &Vector3<f64>,
) -> (Vector3<f64>, Vector3<f64>) {
    let (s_phi, c_phi) = (sin(eta.x), cos(eta.x));
    let (s_theta, c_theta) = (sin(eta.y), cos(eta.y));
    let of = |v: &Vector3<f64>| {
        Vector3::new(v.x - s_theta * v.z, c_phi * v.y + s_phi * c_theta * v.z, c_phi * c_theta * v.z - s_phi * v.y)
    };
    let rates = of(eta_dot);
    // d N/dt d eta/dt: roll turns the last two rows into each other, and pitch changes the elements with theta.
    let (by_roll, by_pitch) = (eta_dot.x, eta_dot.y * eta_dot.z);
    let turning = Vector3::new(
        -c_theta * by_pitch,
        by_roll * rates.z - s_phi * s_theta * by_pitch,
        -by_roll * rates.y - c_phi * s_theta * by_pitch,
    );
    (rates, of(eta_dot_dot) + turning)
}

/// Returns the body axes: the columns of Rz(psi) Ry(theta) Rx(phi).
#[inline]
pub(crate) fn body_axes(x: &SimplifiedVector) -> BodyAxes {
    let (s_phi, c_phi) = (sin(x[6]), cos(x[6]));
    let (s_theta, c_theta) = (sin(x[7]), cos(x[7]));
    let (s_psi, c_psi) = (sin(x[8]), cos(x[8]));
    BodyAxes {
        forward: Vector3::new(c_psi * c_theta, s_psi * c_theta, -s_theta),
        left: Vector3::new(
            c_psi * s_theta * s_phi - s_psi * c_phi,
            s_psi * s_theta * s_phi + c_psi * c_phi,
            c_theta * s_phi,
        ),
        up: Vector3::new(
            c_phi * s_theta * c_psi + s_phi * s_psi,
            c_phi * s_theta * s_psi - s_phi * c_psi,
            c_phi * c_theta,
        ),
    }
}

/// Returns [`derivative`] with the forces that depend on position and velocity. d eta/dt replaces Omega here, too.
#[inline]
pub(crate) fn derivative_in(x: &SimplifiedVector, load: &Load, surroundings: &AirAndGround) -> SimplifiedVector {
    let (velocity, rates) = (Vector3::new(x[3], x[4], x[5]), Vector3::new(x[9], x[10], x[11]));
    let axes = body_axes(x);
    let (a, angular) = surroundings.accelerations(x[2], &velocity, &axes, &rates);
    // Computes the same as `derivative`, for a known direction of the thrust.
    let a = a + load.acceleration(&axes.up);
    let angular = angular + load.angular_acceleration(&rates);
    SimplifiedVector::from([
        velocity.x, velocity.y, velocity.z, a.x, a.y, a.z, rates.x, rates.y, rates.z, angular.x, angular.y, angular.z,
    ])
}

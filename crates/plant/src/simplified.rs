//! The paper's simplified model (6): d eta/dt is taken for Omega.

use crate::motion::Motion;
use crate::vehicle::Load;
use libm::{cos, sin};
use nalgebra::{SVector, Vector3};

/// \[x, y, z, their rates, phi, theta, psi, their rates\]
pub type Vector = SVector<f64, 12>;

/// The model's state vector for `motion`.
pub fn vector(motion: &Motion) -> Vector {
    let mut x = Vector::zeros();
    x.fixed_rows_mut::<3>(0).copy_from(&motion.position_m);
    x.fixed_rows_mut::<3>(3).copy_from(&motion.velocity_m_s);
    x.fixed_rows_mut::<3>(6).copy_from(&motion.attitude_rad);
    x.fixed_rows_mut::<3>(9).copy_from(&motion.rates_rad_s);
    x
}

/// The motion that a state vector stands for.
pub fn motion(x: &Vector) -> Motion {
    Motion {
        position_m: x.fixed_rows::<3>(0).into(),
        velocity_m_s: x.fixed_rows::<3>(3).into(),
        attitude_rad: x.fixed_rows::<3>(6).into(),
        rates_rad_s: x.fixed_rows::<3>(9).into(),
    }
}

/// f(X) of (6), under a load that is held.
#[inline]
pub fn derivative(x: &Vector, load: &Load) -> Vector {
    let Motion { velocity_m_s, attitude_rad: eta, rates_rad_s: eta_dot, .. } = motion(x);
    let (s_phi, c_phi) = (sin(eta.x), cos(eta.x));
    let (s_theta, c_theta) = (sin(eta.y), cos(eta.y));
    let (s_psi, c_psi) = (sin(eta.z), cos(eta.z));
    let thrust_direction =
        Vector3::new(c_phi * s_theta * c_psi + s_phi * s_psi, c_phi * s_theta * s_psi - s_phi * c_psi, c_phi * c_theta);

    let mut x_dot = Vector::zeros();
    x_dot.fixed_rows_mut::<3>(0).copy_from(&velocity_m_s);
    x_dot.fixed_rows_mut::<3>(3).copy_from(&load.acceleration(&thrust_direction));
    x_dot.fixed_rows_mut::<3>(6).copy_from(&eta_dot);
    x_dot.fixed_rows_mut::<3>(9).copy_from(&load.angular_acceleration(&eta_dot));
    x_dot
}

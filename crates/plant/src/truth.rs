//! Input of the instruments: the vehicle's true motion.

use crate::body_axes::BodyAxes;
use crate::frame::PerRotor;
use nalgebra::{Quaternion, Vector3};

/// True motion of the vehicle at one time, with accelerations and rotor speeds. [`Plant::truth`](crate::Plant::truth)
/// creates it.
///
/// The accelerations follow from the equations of motion with all forces of air and ground, the rotors' load and the
/// wind of the last step. Before the first step the rotors are at their initial speeds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Truth {
    /// Time \[s\].
    pub time_s: f64,
    /// xi, earth frame \[m\].
    pub position_m: Vector3<f64>,
    /// d xi/dt, earth frame \[m/s\].
    pub velocity_m_s: Vector3<f64>,
    /// Unit quaternion, body to earth.
    pub attitude: Quaternion<f64>,
    /// Omega, body frame \[rad/s\]; N(eta) d eta/dt in the simplified model.
    pub rates_rad_s: Vector3<f64>,
    /// d^2 xi/dt^2, earth frame \[m/s2\].
    pub acceleration_m_s2: Vector3<f64>,
    /// d Omega/dt, body frame \[rad/s2\].
    pub angular_acceleration_rad_s2: Vector3<f64>,
    /// Gravity \[m/s2\].
    pub gravity_m_s2: f64,
    /// Rotor speeds \[rad/s\]; 0 for rotors that the vehicle does not have.
    pub rotor_speeds_rad_s: PerRotor,
    /// Hover speed of the fastest rotor of the nominal vehicle \[rad/s\].
    pub hover_rad_s: f64,
    /// Thrust of all rotors divided by the nominal vehicle's weight.
    pub thrust_share: f64,
}

impl Truth {
    /// Returns the specific force at the centre of mass, body frame \[m/s2\]: acceleration minus gravity.
    pub fn specific_force_m_s2(&self) -> Vector3<f64> {
        self.to_body(&(self.acceleration_m_s2 + Vector3::new(0.0, 0.0, self.gravity_m_s2)))
    }

    /// Converts a vector from earth to body coordinates.
    pub fn to_body(&self, v: &Vector3<f64>) -> Vector3<f64> {
        let Quaternion { coords: q } = self.attitude;
        BodyAxes::of_quaternion(q.w, q.x, q.y, q.z).to_body(v)
    }
}

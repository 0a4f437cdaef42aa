//! What instruments feel of the vehicle.

use crate::body_axes::BodyAxes;
use crate::frame::Lanes;
use nalgebra::{Quaternion, Vector3};

/// The vehicle's true motion at one time, with its accelerations and rotors. Made by
/// [`Plant::truth`](crate::Plant::truth).
///
/// Accelerations are those of the equations of motion, with all forces of air and ground, under the rotors' load and
/// the wind of the last step; before the first step, under rotors that hover or stand as they start.
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
    /// Omega, body frame \[rad/s\]; in the simplified model N(eta) d eta/dt, the rates of its attitude.
    pub rates_rad_s: Vector3<f64>,
    /// d^2 xi/dt^2, earth frame \[m/s2\].
    pub acceleration_m_s2: Vector3<f64>,
    /// d Omega/dt, body frame \[rad/s2\].
    pub angular_acceleration_rad_s2: Vector3<f64>,
    /// Gravity \[m/s2\].
    pub gravity_m_s2: f64,
    /// Rotor speeds \[rad/s\]; 0 for rotors that the vehicle does not have.
    pub rotor_speeds_rad_s: Lanes,
    /// Speed at which the fastest rotor of the nominal vehicle hovers \[rad/s\].
    pub hover_rad_s: f64,
    /// Thrust of all rotors over the nominal vehicle's weight.
    pub thrust_share: f64,
}

impl Truth {
    /// Returns the specific force at the centre of mass, body frame \[m/s2\]: acceleration less gravity.
    pub fn specific_force_m_s2(&self) -> Vector3<f64> {
        self.to_body(&(self.acceleration_m_s2 + Vector3::new(0.0, 0.0, self.gravity_m_s2)))
    }

    /// Converts a vector from earth to body coordinates.
    pub fn to_body(&self, v: &Vector3<f64>) -> Vector3<f64> {
        let Quaternion { coords: q } = self.attitude;
        BodyAxes::of_quaternion(q.w, q.x, q.y, q.z).to_body(v)
    }
}

//! Control inputs, rotor forces and rotor speeds.

use nalgebra::SVector;

/// The inputs U1..U4 of (6), all in newtons: sums and differences of rotor forces, not moments.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Inputs {
    /// U1 = F3 - F1; the moment about body x is l U1.
    pub roll_n: f32,
    /// U2 = F4 - F2; the moment about body y is l U2.
    pub pitch_n: f32,
    /// U3 = F1 - F2 + F3 - F4; the moment about body z is (d/b) U3.
    pub yaw_n: f32,
    /// U4 = F1 + F2 + F3 + F4, along body z.
    pub thrust_n: f32,
}

/// Thrust F1..F4 of each rotor, along body z \[N\].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RotorForces<const N: usize = 4>(pub SVector<f32, N>);

impl<const N: usize> Default for RotorForces<N> {
    /// All rotors at zero force.
    fn default() -> Self {
        RotorForces(SVector::zeros())
    }
}

/// Speed omega_1..omega_4 of each rotor, never negative \[rad/s\].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RotorSpeeds<const N: usize = 4>(pub SVector<f32, N>);

impl<const N: usize> Default for RotorSpeeds<N> {
    /// All rotors stopped.
    fn default() -> Self {
        RotorSpeeds(SVector::zeros())
    }
}

impl RotorSpeeds {
    /// The residual omega = omega_1 - omega_2 + omega_3 - omega_4 of (6) \[rad/s\].
    pub fn residual_rad_s(&self) -> f32 {
        self.0.x - self.0.y + self.0.z - self.0.w
    }
}

//! Control inputs, rotor forces and rotor speeds.

use crate::{ROTORS_MAX, Rotor};
use nalgebra::SVector;

/// Inputs U1..U4 of (6), all in newtons: sums and differences of rotor forces, not moments.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Inputs {
    /// U1 = sum of y_i F_i / l; F3 - F1 on the paper's frame. The moment about body x is l U1.
    pub roll_n: f32,
    /// U2 = -(sum of x_i F_i) / l; F4 - F2 on the paper's frame. The moment about body y is l U2.
    pub pitch_n: f32,
    /// U3: forces of the rotors that push to positive yaw, minus those of the others; F1 - F2 + F3 - F4 on the paper's
    /// frame. The moment about body z is (d/b) U3.
    pub yaw_n: f32,
    /// U4 = sum of F_i, along body z.
    pub thrust_n: f32,
}

impl Inputs {
    /// Returns U = B F for rotors at these positions with `forces_n` \[N\]. Extra rotors or forces are ignored.
    pub fn of(rotors: &[Rotor], forces_n: &[f32]) -> Self {
        let mut inputs = Inputs::default();
        for (rotor, force_n) in rotors.iter().zip(forces_n) {
            inputs.roll_n += rotor.y * force_n;
            inputs.pitch_n -= rotor.x * force_n;
            inputs.yaw_n += if rotor.pushes_left { *force_n } else { -force_n };
            inputs.thrust_n += force_n;
        }
        inputs
    }
}

/// Returns `values` extended with zeros to the largest number of rotors.
fn padded<const N: usize>(values: &SVector<f32, N>) -> SVector<f32, ROTORS_MAX> {
    SVector::from_fn(|i, _| values.get(i).copied().unwrap_or_default())
}

/// Thrust F_i of each rotor, along body z \[N\].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RotorForces<const N: usize = 4>(pub SVector<f32, N>);

impl<const N: usize> Default for RotorForces<N> {
    /// Returns zero force for all rotors.
    fn default() -> Self {
        RotorForces(SVector::zeros())
    }
}

/// Speed omega_i of each rotor, never negative \[rad/s\].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RotorSpeeds<const N: usize = 4>(pub SVector<f32, N>);

impl<const N: usize> Default for RotorSpeeds<N> {
    /// Returns zero speed for all rotors.
    fn default() -> Self {
        RotorSpeeds(SVector::zeros())
    }
}

impl<const N: usize> RotorForces<N> {
    /// Returns the forces extended with zeros to the largest number of rotors.
    #[must_use]
    pub fn padded(&self) -> RotorForces<ROTORS_MAX> {
        RotorForces(padded(&self.0))
    }
}

impl<const N: usize> RotorSpeeds<N> {
    /// Returns the speeds extended with zeros to the largest number of rotors.
    #[must_use]
    pub fn padded(&self) -> RotorSpeeds<ROTORS_MAX> {
        RotorSpeeds(padded(&self.0))
    }
}

//! Gauss-Markov process for errors that change slowly.

use crate::noise::Noise;
use libm::{exp, sqrt};
use nalgebra::Vector3;

/// First-order Gauss-Markov process of three independent coordinates, dx/dt = -x/T + w, discretised exactly. It starts
/// in its stationary distribution.
#[derive(Clone, Debug)]
pub(super) struct GaussMarkov {
    /// Decay per step, exp(-dt/T).
    decay: f64,
    /// Standard deviation of the noise added per step.
    kick: Vector3<f64>,
    /// Present value.
    pub(super) value: Vector3<f64>,
}

impl GaussMarkov {
    /// Creates the process with the stationary standard deviation `sigma` and correlation time `correlation_s`.
    pub(super) fn new(sigma: Vector3<f64>, correlation_s: f64, step_s: f64, random: &mut Noise) -> Self {
        let decay = exp(-step_s / correlation_s);
        let value = draw(random).component_mul(&sigma);
        GaussMarkov { decay, kick: sigma * sqrt(1.0 - decay * decay), value }
    }

    /// Advances by one step.
    pub(super) fn advance(&mut self, random: &mut Noise) {
        self.value = self.value * self.decay + draw(random).component_mul(&self.kick);
    }
}

/// Draws three normal numbers.
#[inline]
pub(super) fn draw(random: &mut Noise) -> Vector3<f64> {
    Vector3::from(random.normals())
}

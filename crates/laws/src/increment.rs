//! Incremental inversion of the rotational dynamics, shared by INDI and DFBC.
//!
//! ```text
//! dOmega/dt = (G u)_f + nu - (dOmega/dt)_f
//! ```
//!
//! Everything that turns the vehicle apart from the rotors is in (dOmega/dt)_f - (G u)_f. Both signals pass the same
//! filter.

use crate::differentiator::{Differentiator, DifferentiatorMemory};
use nalgebra::Vector3;

/// Filter of both signals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Increment(pub(crate) Differentiator);

/// Filtered effect of the rotors and filtered reaction of the vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct IncrementMemory {
    /// G u \[rad/s2\]
    rotor_acceleration: DifferentiatorMemory,
    rates: DifferentiatorMemory,
}

impl Increment {
    /// Filters G u and the measured rates of this step. Call it only with a new measurement, so that both stay
    /// synchronous.
    #[inline]
    pub(crate) fn measure(
        &self,
        reaction: &mut IncrementMemory,
        given_rad_s2: &Vector3<f32>,
        rates_rad_s: &Vector3<f32>,
    ) {
        self.0.advance(&mut reaction.rotor_acceleration, given_rad_s2);
        self.0.advance(&mut reaction.rates, rates_rad_s);
    }

    /// Returns the part of dOmega/dt that the rotors must give for a total of `nu` \[rad/s2\].
    #[inline]
    pub(crate) fn invert(&self, reaction: &IncrementMemory, nu: &Vector3<f32>) -> Vector3<f32> {
        reaction.rotor_acceleration.value() + (nu - reaction.rates.derivative())
    }
}

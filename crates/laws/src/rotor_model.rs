//! Model of the rotor lag: present rotor speeds from the commands and a time constant.
//!
//! ```text
//! omega_i += (1 - exp(-dt/tau)) (omega_i commanded - omega_i)
//! ```
//!
//! The speeds start at hover. The commands are those after rotor limits, so the model cannot wind up.

use crate::body::NominalVehicle;
use afbc_control::math;
use afbc_types::{Inputs, RotorSpeeds};

/// Rotor model with its constants. The speeds are in [`RotorModelMemory`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RotorModel<const N: usize> {
    hover: RotorSpeeds<N>,
    /// 1 - exp(-dt / tau)
    gain: f32,
}

/// Speeds of the modelled rotors, `None` before the first step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct RotorModelMemory<const N: usize>(Option<RotorSpeeds<N>>);

impl<const N: usize> RotorModel<N> {
    /// Creates a model with this time constant; 0 means no lag.
    pub(crate) fn new(body: &NominalVehicle<N>, weight_n: f32, time_constant_s: f32, dt_s: f32) -> Self {
        let gain = if time_constant_s > 0.0 { 1.0 - math::exp(-dt_s / time_constant_s) } else { 1.0 };
        RotorModel { hover: body.hover(weight_n), gain }
    }

    /// Returns the present U1..U4 of the rotors.
    #[inline]
    pub(crate) fn inputs(&self, body: &NominalVehicle<N>, spin: &RotorModelMemory<N>) -> Inputs {
        body.mixer.inputs(&body.mixer.forces(&spin.0.unwrap_or(self.hover)))
    }

    /// Advances the rotor speeds by one step with these commands.
    #[inline]
    pub(crate) fn advance(&self, spin: &mut RotorModelMemory<N>, commanded: &RotorSpeeds<N>) {
        let rotors = spin.0.unwrap_or(self.hover);
        spin.0 = Some(RotorSpeeds((rotors.0 + (commanded.0 - rotors.0) * self.gain).map(math::settled)));
    }
}

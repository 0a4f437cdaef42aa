//! Result of a control step.

use afbc_types::{Inputs, ROTORS_MAX, RotorForces, RotorSpeeds};

/// Result of a control step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use = "the motors need the rotor speeds"]
#[non_exhaustive]
pub struct Action<const N: usize = 4> {
    /// Rotor speeds omega_i, finite and never negative.
    pub speeds: RotorSpeeds<N>,
    /// Rotor forces F_i, within the rotors' limits.
    pub forces: RotorForces<N>,
    /// Inputs U1..U4 that these forces give.
    pub given: Inputs,
    /// Faults of the step.
    pub health: Health,
}

impl<const N: usize> Action<N> {
    /// Makes the action of a step with a plausible state and setpoint, from rotor speeds, forces and the inputs that
    /// they give.
    #[inline]
    pub fn new(speeds: RotorSpeeds<N>, forces: RotorForces<N>, given: Inputs, saturated: bool) -> Self {
        Action { speeds, forces, given, health: Health { saturated, ..Health::default() } }
    }

    /// Returns the action extended with zeros to the largest number of rotors.
    pub fn padded(&self) -> Action<ROTORS_MAX> {
        Action { speeds: self.speeds.padded(), forces: self.forces.padded(), given: self.given, health: self.health }
    }
}

/// Faults of a step; all false in normal flight.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Health {
    /// The measurement was missing or implausible (see [`State::is_plausible`](afbc_types::State::is_plausible)). The
    /// last plausible state was used instead, and no estimate changed. Without one, the rotors stay stopped.
    pub state_rejected: bool,
    /// The setpoint was implausible. The last plausible one was used instead. Without one, the position at that moment
    /// is held.
    pub setpoint_rejected: bool,
    /// A rotor force was limited.
    pub saturated: bool,
    /// Reason why a fallback law flies instead of the controller's own, if so: at most 50 characters, for a station's
    /// status text. `serde` writes this field, but does not read it.
    #[cfg_attr(feature = "serde", serde(skip_deserializing))]
    pub fallback: Option<&'static str>,
}

//! What one step decides.

use crate::Trip;
use afbc_types::{RotorForces, RotorSpeeds};

/// What one step decides.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use = "the rotors turn by it"]
#[non_exhaustive]
pub struct Action {
    /// omega_i, always finite and never negative.
    pub speeds: RotorSpeeds,
    /// F_i, within the rotors' limits.
    pub forces: RotorForces,
    /// What went wrong.
    pub health: Health,
}

impl Action {
    /// An action on a plausible state and setpoint.
    #[inline]
    pub fn new(speeds: RotorSpeeds, forces: RotorForces, saturated: bool) -> Self {
        Action { speeds, forces, health: Health { saturated, ..Health::default() } }
    }
}

/// What went wrong in a step; all false in normal flight.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Health {
    /// There was no measurement, or an implausible one (see [`State::is_plausible`](afbc_types::State::is_plausible)); the
    /// last plausible one stood in for it and no estimate changed. If there was none yet, the rotors stay still.
    pub state_rejected: bool,
    /// The setpoint was implausible; the last plausible one stood in for it, or if there was none yet, a hold of the
    /// position of that moment.
    pub setpoint_rejected: bool,
    /// A rotor was asked for a force outside its limits.
    pub saturated: bool,
    /// Why another law flies in the controller's place, if one does.
    pub trip: Option<Trip>,
}

//! Transition table of the flight modes: which mode may be selected, and which is forced. Pure functions; docs/modes.md
//! has the table.

use crate::mode::FlightMode;
use crate::order::OrderRefusal;

/// Action of a failsafe, from the weakest to the strongest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum FailsafeAction {
    /// No action.
    #[default]
    None,
    /// Announcement only.
    Warn,
    /// Forces [`FlightMode::Hold`].
    Hold,
    /// Forces [`FlightMode::Return`]; on the ground, disarms.
    Return,
    /// Forces [`FlightMode::Land`]; on the ground, disarms.
    Land,
}

impl FailsafeAction {
    /// Returns the mode that the action forces, if any.
    pub const fn mode(self) -> Option<FlightMode> {
        match self {
            FailsafeAction::None | FailsafeAction::Warn => None,
            FailsafeAction::Hold => Some(FlightMode::Hold),
            FailsafeAction::Return => Some(FlightMode::Return),
            FailsafeAction::Land => Some(FlightMode::Land),
        }
    }

    /// True if `mode` is at least as strong as the action.
    pub const fn is_done_by(self, mode: FlightMode) -> bool {
        let does = match mode {
            FlightMode::Land => FailsafeAction::Land,
            FlightMode::Return => FailsafeAction::Return,
            FlightMode::Hold => FailsafeAction::Hold,
            _ => FailsafeAction::Warn,
        };
        // The values are compared by number, since the derived order is not const.
        does as u8 >= self as u8
    }
}

/// Conditions of the transitions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TransitionInputs {
    /// The flight core is armed.
    pub armed: bool,
    /// The vehicle is in the air.
    pub airborne: bool,
    /// The vehicle knows where it is.
    pub positioned: bool,
    /// The flight core descends, and no state has come back yet.
    pub descends: bool,
    /// There is a mission.
    pub mission: bool,
    /// There are fresh targets of a companion computer.
    pub targets: bool,
    /// There are fresh sticks of a pilot.
    pub sticks: bool,
    /// Action that the failsafes demand.
    pub held: FailsafeAction,
}

impl TransitionInputs {
    /// Returns the action demanded by flight core and failsafes together.
    fn demanded(&self) -> FailsafeAction {
        if self.armed && self.descends { FailsafeAction::Land } else { self.held }
    }
}

/// Checks whether `mode` may be selected.
///
/// # Errors
/// The first condition that is not met.
pub fn select(mode: FlightMode, seen: &TransitionInputs) -> Result<(), OrderRefusal> {
    use FlightMode::{Acro, Altitude, Hold, Land, Mission, Offboard, Position, Return, Stabilised, Takeoff};
    let unless = |holds: bool, declined: OrderRefusal| if holds { Err(declined) } else { Ok(()) };
    unless(!seen.demanded().is_done_by(mode), OrderRefusal::Failsafe)?;
    unless(mode != Land && !seen.positioned, OrderRefusal::NoPosition)?;
    match mode {
        Hold => Ok(()),
        // A disarmed vehicle would stay in this mode, in which it cannot be armed.
        Land => unless(!seen.armed, OrderRefusal::NotArmed),
        Takeoff => unless(seen.airborne, OrderRefusal::InFlight),
        Return => unless(!seen.airborne, OrderRefusal::OnGround),
        Mission => unless(!seen.mission, OrderRefusal::NoMission),
        Offboard => unless(!seen.targets, OrderRefusal::NoTargets),
        Position | Altitude | Stabilised | Acro => unless(!seen.sticks, OrderRefusal::NoSticks),
    }
}

/// Returns the mode forced on an armed vehicle; `None` if `mode` is already strong enough.
pub fn forced(mode: FlightMode, seen: &TransitionInputs) -> Option<FlightMode> {
    let demanded = seen.demanded();
    // On the ground, stronger actions than hold do not change the mode.
    let demanded = if seen.airborne || seen.descends { demanded } else { demanded.min(FailsafeAction::Hold) };
    demanded.mode().filter(|_| seen.armed && !demanded.is_done_by(mode))
}

//! Transitions of the flight mode: what may be selected, and what is forced. Pure functions; the table is in
//! docs/modes.md.

use crate::mode::FlightMode;
use crate::order::OrderRefusal;

/// What the safety net does, from the weakest to the strongest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum FailsafeAction {
    /// Nothing.
    #[default]
    None,
    /// An announcement.
    Warn,
    /// [`FlightMode::Hold`].
    Hold,
    /// [`FlightMode::Return`]; on the ground it disarms.
    Return,
    /// [`FlightMode::Land`]; on the ground it disarms.
    Land,
}

impl FailsafeAction {
    /// Returns the mode that it forces.
    pub const fn mode(self) -> Option<FlightMode> {
        match self {
            FailsafeAction::None | FailsafeAction::Warn => None,
            FailsafeAction::Hold => Some(FlightMode::Hold),
            FailsafeAction::Return => Some(FlightMode::Return),
            FailsafeAction::Land => Some(FlightMode::Land),
        }
    }

    /// True if `mode` does at least as much.
    pub const fn is_done_by(self, mode: FlightMode) -> bool {
        let does = match mode {
            FlightMode::Land => FailsafeAction::Land,
            FlightMode::Return => FailsafeAction::Return,
            FlightMode::Hold => FailsafeAction::Hold,
            _ => FailsafeAction::Warn,
        };
        // By number: the order that is derived is not const.
        does as u8 >= self as u8
    }
}

/// What the transitions depend on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TransitionInputs {
    /// The flight core is armed.
    pub armed: bool,
    /// The vehicle is in the air.
    pub airborne: bool,
    /// The vehicle knows where it is.
    pub positioned: bool,
    /// The flight core descends, and no state has come back.
    pub descends: bool,
    /// There is an item of a mission.
    pub mission: bool,
    /// There are fresh targets of a companion computer.
    pub targets: bool,
    /// There are fresh sticks of a pilot.
    pub sticks: bool,
    /// What the safety net demands.
    pub held: FailsafeAction,
}

impl TransitionInputs {
    /// Returns what flight core and safety net demand together.
    fn demanded(&self) -> FailsafeAction {
        if self.armed && self.descends { FailsafeAction::Land } else { self.held }
    }
}

/// Returns whether `mode` may be selected.
///
/// # Errors
/// The first reason against it.
pub fn select(mode: FlightMode, seen: &TransitionInputs) -> Result<(), OrderRefusal> {
    use FlightMode::{Acro, Altitude, Hold, Land, Mission, Offboard, Position, Return, Stabilised, Takeoff};
    let unless = |holds: bool, declined: OrderRefusal| if holds { Err(declined) } else { Ok(()) };
    unless(!seen.demanded().is_done_by(mode), OrderRefusal::Failsafe)?;
    unless(mode != Land && !seen.positioned, OrderRefusal::NoPosition)?;
    match mode {
        Hold => Ok(()),
        // Disarmed, it would stay a mode that nothing is armed in.
        Land => unless(!seen.armed, OrderRefusal::NotArmed),
        Takeoff => unless(seen.airborne, OrderRefusal::InFlight),
        Return => unless(!seen.airborne, OrderRefusal::OnGround),
        Mission => unless(!seen.mission, OrderRefusal::NoMission),
        Offboard => unless(!seen.targets, OrderRefusal::NoTargets),
        Position | Altitude | Stabilised | Acro => unless(!seen.sticks, OrderRefusal::NoSticks),
    }
}

/// Returns the mode that is forced on an armed vehicle in `mode`, if another one is.
pub fn forced(mode: FlightMode, seen: &TransitionInputs) -> Option<FlightMode> {
    let demanded = seen.demanded();
    // On the ground it stays there.
    let demanded = if seen.airborne || seen.descends { demanded } else { demanded.min(FailsafeAction::Hold) };
    demanded.mode().filter(|_| seen.armed && !demanded.is_done_by(mode))
}

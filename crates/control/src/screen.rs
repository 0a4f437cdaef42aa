//! What a controller may believe: implausible input never reaches a law.

use crate::Health;
use afbc_types::{Setpoint, State};

/// What a controller remembers between steps, with the last plausible state and setpoint.
///
/// The default is that of a controller that has not flown yet.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Screened<M> {
    screen: Screen,
    /// Of the controller behind the screen.
    pub control: M,
}

impl<M> Screened<M> {
    /// The screen, and the memory behind it.
    #[inline]
    pub(crate) fn parts(&mut self) -> (&mut Screen, &mut M) {
        (&mut self.screen, &mut self.control)
    }
}

/// The last plausible state and setpoint.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Screen {
    state: Option<State>,
    setpoint: Option<Setpoint>,
}

impl Screen {
    /// The state and the setpoint to work from: those given where they are plausible, otherwise the last ones that were.
    /// Without any plausible setpoint so far, a hold of the present position; without any plausible state so far, `None`.
    /// `health` tells what was refused.
    #[inline]
    pub fn pass(
        &mut self,
        measured: Option<&State>,
        setpoint: &Setpoint,
        health: &mut Health,
    ) -> Option<(State, Setpoint)> {
        let measured = measured.filter(|state| state.is_plausible());
        health.state_rejected = measured.is_none();
        health.setpoint_rejected = !setpoint.is_plausible();
        if let Some(state) = measured {
            self.state = Some(*state);
        }
        if !health.setpoint_rejected {
            self.setpoint = Some(*setpoint);
        }
        let state = self.state?;
        Some((state, *self.setpoint.get_or_insert(Setpoint::hold(&state))))
    }
}

//! Input screen: keeps implausible states and setpoints away from the control law.

use crate::Health;
use afbc_types::{Setpoint, State};

/// A controller's memory together with its input screen.
///
/// The default is the memory before the first step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Validated<M> {
    screen: Screen,
    /// Memory of the controller behind the screen.
    pub control: M,
}

impl<M> Validated<M> {
    /// Returns the screen and the controller's memory.
    #[inline]
    pub(crate) fn parts(&mut self) -> (&mut Screen, &mut M) {
        (&mut self.screen, &mut self.control)
    }
}

/// Last plausible state and setpoint.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Screen {
    state: Option<State>,
    setpoint: Option<Setpoint>,
}

impl Screen {
    /// Returns state and setpoint if plausible, and otherwise replaces them by the last plausible ones. Without a
    /// plausible setpoint so far, the setpoint holds the present position. Without a plausible state so far, returns
    /// `None`. `health` reports rejected inputs.
    #[inline]
    pub fn pass(
        &mut self,
        measured: Option<&State>,
        setpoint: &Setpoint,
        health: &mut Health,
    ) -> Option<(&State, &Setpoint)> {
        let measured = measured.filter(|state| state.is_plausible());
        health.state_rejected = measured.is_none();
        health.setpoint_rejected = !setpoint.is_plausible();
        if let Some(state) = measured {
            self.state = Some(*state);
        }
        if !health.setpoint_rejected {
            self.setpoint = Some(*setpoint);
        }
        let state = self.state.as_ref()?;
        // The setpoint is kept over the steps: the hold must not follow a vehicle that drifts away.
        Some((state, self.setpoint.get_or_insert_with(|| Setpoint::hold(state))))
    }
}

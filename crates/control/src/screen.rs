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
    /// Returns the screen and the memory behind it.
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
    /// Returns the given state and setpoint where they are plausible, otherwise the last ones that were. Without any
    /// plausible setpoint so far, the setpoint holds the present position; without any plausible state so far, the
    /// result is `None`. `health` reports what was rejected.
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
        // Kept, not made anew in each step: it must not follow a vehicle that drifts away.
        Some((state, self.setpoint.get_or_insert_with(|| Setpoint::hold(state))))
    }
}

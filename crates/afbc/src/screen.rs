//! What a controller may believe: implausible input never reaches a law.

use crate::Health;
use afbc_types::{Setpoint, State};

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
    pub fn pass(&mut self, state: &State, setpoint: &Setpoint, health: &mut Health) -> Option<(State, Setpoint)> {
        health.state_rejected = !state.is_plausible();
        health.setpoint_rejected = !setpoint.is_plausible();
        if !health.state_rejected {
            self.state = Some(*state);
        }
        if !health.setpoint_rejected {
            self.setpoint = Some(*setpoint);
        }
        let state = self.state?;
        Some((state, *self.setpoint.get_or_insert(Setpoint::hold(&state))))
    }
}

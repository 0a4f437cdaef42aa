//! Descent with states that have returned: straight down from the position of the first one until landing is detected
//! ([`crate::landing`]). Not in the paper.

use afbc_types::{Setpoint, State};

/// Speed of the descent \[m/s\].
pub const SINK_M_S: f32 = 0.5;
/// A descent in progress.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Descent {
    setpoint: Setpoint,
}

impl Descent {
    /// Starts a descent from `state`.
    pub fn new(state: &State) -> Self {
        let mut setpoint = Setpoint::hold(state);
        setpoint.velocity_m_s.z = -SINK_M_S;
        Descent { setpoint }
    }

    /// Lowers the setpoint by one step.
    pub fn advance(&mut self, dt_s: f32) {
        self.setpoint.position_m.z -= SINK_M_S * dt_s;
    }

    /// Returns the present setpoint.
    pub fn setpoint(&self) -> &Setpoint {
        &self.setpoint
    }
}

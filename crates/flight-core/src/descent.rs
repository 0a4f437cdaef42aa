//! Coming down with a state that came back: straight down from where it came back, until the vehicle has landed
//! ([`crate::landing`]). Ours.

use afbc_types::{Setpoint, State};

/// Speed of the descent \[m/s\].
pub const SINK_M_S: f32 = 0.5;
/// A descent under way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Descent {
    setpoint: Setpoint,
}

impl Descent {
    /// Starts down from `state`.
    pub fn new(state: &State) -> Self {
        let mut setpoint = Setpoint::hold(state);
        setpoint.velocity_m_s.z = -SINK_M_S;
        Descent { setpoint }
    }

    /// One step: the setpoint sinks.
    pub fn advance(&mut self, dt_s: f32) {
        self.setpoint.position_m.z -= SINK_M_S * dt_s;
    }

    /// Where the vehicle should be.
    pub fn setpoint(&self) -> &Setpoint {
        &self.setpoint
    }
}

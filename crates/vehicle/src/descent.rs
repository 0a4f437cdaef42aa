//! Coming down with a state that came back: straight down from where it came back, until the ground stops the vehicle.
//! Ours.

use airframe::{Setpoint, State};

/// Speed of the descent \[m/s\].
pub const SINK_M_S: f32 = 0.5;
/// A descending vehicle whose vertical speed is below this stands on something \[m/s\],
pub const STILL_M_S: f32 = 0.1;
/// if it stays there for this long \[us\].
pub const STILL_US: u64 = 1_000_000;

/// A descent under way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Descent {
    setpoint: Setpoint,
    /// When the vehicle last moved vertically \[us\].
    moved_us: u64,
}

impl Descent {
    /// Starts down from `state`.
    pub fn new(state: &State, now_us: u64) -> Self {
        let mut setpoint = Setpoint::hold(state);
        setpoint.velocity_m_s.z = -SINK_M_S;
        Descent { setpoint, moved_us: now_us }
    }

    /// One step: the setpoint sinks, `state` says whether the vehicle does.
    pub fn advance(&mut self, state: &State, now_us: u64, dt_s: f32) {
        self.setpoint.position_m.z -= SINK_M_S * dt_s;
        if state.velocity_m_s.z.abs() > STILL_M_S {
            self.moved_us = now_us;
        }
    }

    /// Where the vehicle should be.
    pub fn setpoint(&self) -> &Setpoint {
        &self.setpoint
    }

    /// True if the ground has stopped the vehicle.
    pub fn landed(&self, now_us: u64) -> bool {
        now_us.saturating_sub(self.moved_us) > STILL_US
    }
}

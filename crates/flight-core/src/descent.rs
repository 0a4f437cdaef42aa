//! Descent with states that have returned, or without a position: straight down from where the vehicle was seen, until
//! landing is detected ([`crate::landing`]). Not in the paper.

use afbc_control::math::{settled, wrap_angle};
use afbc_types::{ResetDelta, Setpoint, State};
use nalgebra::{Vector2, Vector3};

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

    /// Shifts it with an estimate that has been set anew.
    pub(crate) fn shift(&mut self, reset: &ResetDelta) {
        shift(&mut self.setpoint, reset);
    }

    /// Returns the present setpoint.
    pub fn setpoint(&self) -> &Setpoint {
        &self.setpoint
    }
}

/// Shifts a setpoint with an estimate that has been set anew.
pub(crate) fn shift(setpoint: &mut Setpoint, reset: &ResetDelta) {
    setpoint.position_m += reset.position_m;
    setpoint.yaw_rad = wrap_angle(setpoint.yaw_rad + reset.yaw_rad);
}

/// Times with which the estimated velocity loses its meaning, and with which what was made of it, and the way, fade
/// \[s\].
const TRUST_S: f32 = 2.0;
const VELOCITY_S: f32 = 2.0;
const WAY_S: f32 = 1.0;
/// Largest change of the estimated velocity in a tick that is a motion, and no correction \[m/s\].
const STEP_MAX_M_S: f32 = 0.2;

/// Horizontal motion of a vehicle that has lost its position, as the law sees it.
///
/// At first it is that of the estimate, so that the law brakes as usual. It fades within seconds, like the estimate's
/// meaning: the law then sees no error, and holds what it has learnt of the wind. Were the setpoint to stand at once, a
/// velocity error that no tilt changes would make it lean, and learn, ever more.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drift {
    /// Where it was seen last.
    place_m: Vector2<f32>,
    way_m: Vector2<f32>,
    velocity_m_s: Vector2<f32>,
    estimated_m_s: Vector2<f32>,
    /// Share of a change of the estimated velocity that counts.
    trust: f32,
}

impl Drift {
    /// Begins at `place_m`, where the vehicle was seen last, with the velocity of `state`.
    pub fn new(place_m: Vector2<f32>, state: &State) -> Self {
        let velocity_m_s = state.velocity_m_s.xy();
        Drift { place_m, way_m: Vector2::zeros(), velocity_m_s, estimated_m_s: velocity_m_s, trust: 1.0 }
    }

    /// Advances by one step, and returns `state` with this horizontal motion.
    pub fn advance(&mut self, state: &State, dt_s: f32) -> State {
        let estimated_m_s = state.velocity_m_s.xy();
        let change_m_s = estimated_m_s - self.estimated_m_s;
        self.estimated_m_s = estimated_m_s;
        if change_m_s.norm_squared() <= STEP_MAX_M_S * STEP_MAX_M_S {
            self.velocity_m_s += change_m_s * self.trust;
        }
        self.trust = settled(self.trust - self.trust * (dt_s / TRUST_S));
        self.velocity_m_s = (self.velocity_m_s - self.velocity_m_s * (dt_s / VELOCITY_S)).map(settled);
        self.way_m = (self.way_m + (self.velocity_m_s - self.way_m / WAY_S) * dt_s).map(settled);
        let (p, v) = (self.place_m + self.way_m, &self.velocity_m_s);
        State {
            position_m: Vector3::new(p.x, p.y, state.position_m.z),
            velocity_m_s: Vector3::new(v.x, v.y, state.velocity_m_s.z),
            ..*state
        }
    }
}

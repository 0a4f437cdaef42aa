//! Descent after states have returned, or without a position: straight down from the vehicle's last known place until
//! the landing is detected ([`crate::landing`]). Not in the paper.

use afbc_control::math::{settled, wrap_angle};
use afbc_types::{ResetDelta, Setpoint, State};
use nalgebra::{Vector2, Vector3};

/// Speed of the descent \[m/s\].
pub const SINK_M_S: f32 = 0.5;
/// Descent in progress.
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

    /// Shifts the descent by an estimator reset.
    pub(crate) fn shift(&mut self, reset: &ResetDelta) {
        shift(&mut self.setpoint, reset);
    }

    /// Returns the present setpoint.
    pub fn setpoint(&self) -> &Setpoint {
        &self.setpoint
    }
}

/// Shifts a setpoint by an estimator reset.
pub(crate) fn shift(setpoint: &mut Setpoint, reset: &ResetDelta) {
    setpoint.position_m += reset.position_m;
    setpoint.yaw_rad = wrap_angle(setpoint.yaw_rad + reset.yaw_rad);
}

/// Time constants \[s\] with which three things fade after the loss of the position: the trust in the estimated
/// velocity, the velocity shown to the law, and the distance shown to the law.
const TRUST_S: f32 = 2.0;
const VELOCITY_S: f32 = 2.0;
const WAY_S: f32 = 1.0;
/// Largest change of the estimated velocity in a tick that counts as motion; a larger one is an estimator correction
/// \[m/s\].
const STEP_MAX_M_S: f32 = 0.2;

/// Horizontal motion shown to the law of a vehicle that has lost its position.
///
/// At first it is the estimate's motion, so that the law brakes as usual. It fades to zero within seconds, as the
/// estimate becomes worthless. The law then sees no error, and keeps the wind that it has learnt. If the setpoint stood
/// still at once instead, a velocity error that no tilt can change would make the law lean, and learn, ever more.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drift {
    /// Last known place.
    place_m: Vector2<f32>,
    way_m: Vector2<f32>,
    velocity_m_s: Vector2<f32>,
    estimated_m_s: Vector2<f32>,
    /// Trust in the estimate: the share of a change of its velocity that counts.
    trust: f32,
}

impl Drift {
    /// Starts at the last known place `place_m`, with the velocity of `state`.
    pub fn new(place_m: Vector2<f32>, state: &State) -> Self {
        let velocity_m_s = state.velocity_m_s.xy();
        Drift { place_m, way_m: Vector2::zeros(), velocity_m_s, estimated_m_s: velocity_m_s, trust: 1.0 }
    }

    /// Advances by one step, and returns `state` with the faded horizontal motion.
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

//! Whether the vehicle stands on something, from how it moves and what its rotors are told. Ours, in the manner of
//! autopilots' land detectors.
//!
//! Armed, a vehicle is on the ground until it moves away or its rotors have carried it for a moment. It has landed where
//! thrust and motion agree that something else carries it: it was seen to sink and to stop, and it stays still for a second
//! although its rotors do not carry it. One that is said to be still all along while its thrust falls away has not
//! landed: its tracker has frozen.
//!
//! A law may look for a standstill of its own, to stop learning (`afbc::standstill`): from the thrust that it wants, and
//! sooner, since no motor is disarmed for it.

use afbc_control::math::abs_max;
use afbc_types::State;
use nalgebra::Vector3;

/// How far from where it stood a vehicle is in the air \[m\].
pub const LEFT_M: f32 = 0.15;
/// How fast a vehicle is in the air, along any axis \[m/s\].
pub const LEFT_M_S: f32 = 0.5;
/// Speed along each axis up to which a vehicle is still \[m/s\].
pub const STILL_M_S: f32 = 0.1;
/// Speed downwards at which a vehicle is seen to sink \[m/s\].
pub const SINKS_M_S: f32 = 0.2;
/// Share of the usual thrust up to which rotors do not carry the vehicle.
pub const CARRY_SHARE: f32 = 0.6;
/// Time constant of the usual thrust \[s\].
pub const USUAL_S: f32 = 5.0;
/// How long rotors have to carry a vehicle for it to be in the air \[us\].
pub const CARRIED_US: u64 = 500_000;
/// How long a vehicle has to be still and not carried to have landed \[us\].
pub const STILL_US: u64 = 1_000_000;
/// The same for one that was not seen to sink: from then on its tracker is not believed \[us\].
pub const FROZEN_US: u64 = 500_000;
/// How long a vehicle has to hover for an earlier descent to be forgotten \[us\].
pub const HOVER_US: u64 = 2_000_000;

/// Tells whether the vehicle is in the air, and when it has landed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LandDetector {
    airborne: bool,
    /// True if it has moved away from where it stood.
    left: bool,
    /// True if it was seen to sink since it last hovered.
    sank: bool,
    /// Where it stood \[m\].
    stood_m: Vector3<f32>,
    /// Mean thrust in the air \[N\].
    usual_n: f32,
    /// When it was last not still, last carried and last not carried \[us\].
    moved_us: u64,
    carried_us: u64,
    uncarried_us: u64,
}

impl LandDetector {
    /// A vehicle of this weight that is armed in this state.
    pub fn new(state: &State, weight_n: f32, now_us: u64) -> Self {
        LandDetector {
            airborne: false,
            left: false,
            sank: false,
            stood_m: state.position_m,
            usual_n: weight_n,
            moved_us: now_us,
            carried_us: now_us,
            uncarried_us: now_us,
        }
    }

    /// Takes one tick with a fresh state into account, in which the rotors gave `thrust_n`.
    pub fn advance(&mut self, state: &State, thrust_n: f32, now_us: u64, dt_s: f32) {
        let speed_m_s = abs_max(&state.velocity_m_s);
        if speed_m_s > STILL_M_S {
            self.moved_us = now_us;
        }
        if thrust_n > CARRY_SHARE * self.usual_n {
            self.carried_us = now_us;
        } else {
            self.uncarried_us = now_us;
        }
        self.sank |= state.velocity_m_s.z < -SINKS_M_S;
        self.left |= speed_m_s > LEFT_M_S || abs_max(&(state.position_m - self.stood_m)) > LEFT_M;
        self.airborne |= self.left || now_us.saturating_sub(self.uncarried_us) >= CARRIED_US;
        if self.airborne {
            self.usual_n += dt_s / USUAL_S * (thrust_n - self.usual_n);
        }

        let still_us = now_us.saturating_sub(self.moved_us);
        if still_us >= HOVER_US && self.carried_us == now_us {
            self.sank = false;
        }
        if self.stands_for_us(now_us) > STILL_US && (self.sank || !self.left) {
            let usual_n = self.usual_n;
            *self = LandDetector { usual_n, ..LandDetector::new(state, usual_n, now_us) };
        }
    }

    /// Takes one tick without a fresh state into account.
    pub fn advance_blind(&mut self, now_us: u64) {
        self.moved_us = now_us;
    }

    /// True if nothing but its rotors carries the vehicle.
    pub fn airborne(&self) -> bool {
        self.airborne
    }

    /// True if the vehicle is said to hang still in the air, carried by nothing.
    pub fn contradicts(&self, now_us: u64) -> bool {
        self.left && !self.sank && self.stands_for_us(now_us) > FROZEN_US
    }

    /// For how long it has been still and not carried.
    fn stands_for_us(&self, now_us: u64) -> u64 {
        now_us.saturating_sub(self.moved_us.max(self.carried_us))
    }
}

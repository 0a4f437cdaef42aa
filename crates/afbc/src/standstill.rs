//! Whether the vehicle stands still on something that carries it, so that there is nothing to learn from its errors. Not in
//! the paper; in the manner of autopilots' land detectors: in the air, a vehicle whose law wants too little thrust to carry
//! it is soon too fast to be standing. (What the rotors give does not tell: roll and pitch come before thrust, and may keep
//! it up.)
//!
//! Landings are the flight core's to detect, and apart from this: it knows no law, only what the rotors were told, and it
//! disarms, so it takes a second to be sure. This one only rests a law, and takes 0.2 s.

use nalgebra::Vector3;

/// Share of the weight below which the thrust is not meant to carry the vehicle.
pub const LIFT_SHARE: f32 = 0.4;
/// Speed along each axis below which the vehicle is still \[m/s\].
pub const STILL_M_S: f32 = 0.1;
/// Speed along an axis at which a vehicle that stood does no longer \[m/s\]: more than rocking on its feet, and reached in
/// 0.1 s of falling.
pub const MOVING_M_S: f32 = 0.5;
/// How long both must last \[s\].
pub const STILL_S: f32 = 0.2;

/// How long the vehicle may have been standing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Standstill {
    still_s: f32,
}

impl Standstill {
    /// Takes one step into account: U4 that was wanted \[N\].
    #[inline]
    pub fn advance(&mut self, thrust_n: f32, weight_n: f32, velocity_m_s: &Vector3<f32>, dt_s: f32) {
        let speed_max = if self.stands() { MOVING_M_S } else { STILL_M_S };
        let still = || velocity_m_s.iter().all(|v| v.abs() < speed_max);
        self.still_s = if thrust_n < LIFT_SHARE * weight_n && still() { self.still_s + dt_s } else { 0.0 };
    }

    /// True if the ground carries the vehicle.
    #[inline]
    pub fn stands(&self) -> bool {
        self.still_s > STILL_S
    }
}

//! Detector of a vehicle that stands on the ground, where its errors must not be learnt. Not in the paper; similar to
//! land detectors of autopilots: in the air, a vehicle whose law demands too little thrust soon moves too fast to be
//! standing. (The thrust produced is no indication, since roll and pitch have priority over thrust and may increase
//! it.)
//!
//! The flight core's land detector is separate: it knows the commands to the rotors but not the law's demands, and
//! disarms, so it takes a second to be sure. This detector only stops the adaptation, and takes 0.2 s.

use nalgebra::Vector3;

/// Share of the weight below which the demanded thrust does not carry the vehicle.
pub const LIFT_SHARE: f32 = 0.4;
/// Speed along each axis below which the vehicle is at rest \[m/s\].
pub const STILL_M_S: f32 = 0.3;
/// Speed along an axis at which a vehicle no longer stands \[m/s\]: more than rocking on its feet, and reached in 0.1 s
/// of falling.
pub const MOVING_M_S: f32 = 0.5;
/// Time for which both must last \[s\].
pub const STILL_S: f32 = 0.2;

/// Detector of a standing vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Standstill {
    still_s: f32,
}

impl Standstill {
    /// Processes one step, with the demanded U4 \[N\].
    #[inline]
    pub fn advance(&mut self, thrust_n: f32, weight_n: f32, velocity_m_s: &Vector3<f32>, dt_s: f32) {
        let speed_max = if self.stands() { MOVING_M_S } else { STILL_M_S };
        let still = || velocity_m_s.iter().all(|v| v.abs() < speed_max);
        self.still_s = if thrust_n < LIFT_SHARE * weight_n && still() { self.still_s + dt_s } else { 0.0 };
    }

    /// True if the vehicle stands on the ground.
    #[inline]
    pub fn stands(&self) -> bool {
        self.still_s > STILL_S
    }
}

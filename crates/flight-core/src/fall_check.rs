//! Detects that a vehicle stands on the ground, by its inertial sensor: its rotors do not carry it, and it does not
//! fall. This detects the ground within half a second, even if the estimated velocity is off by tenths of a metre per
//! second. It is not applied to tracker states, since a frozen tracker would look the same. Not in the paper.

use crate::landing::CARRY_SHARE;
use afbc_control::math::abs_max;
use nalgebra::Vector3;

/// Speed that a free fall would have gained when the check decides \[m/s\]. A falling
/// vehicle whose rotors follow as slowly as within 0.1 s gains 1 m/s less.
pub const FALL_M_S: f32 = 3.0;
/// A vehicle that has gained less than this share of a fall's speed stands on the ground.
pub const FALL_SHARE: f32 = 0.5;
/// Largest speed along any axis at which the check applies \[m/s\]. Drag may carry a faster vehicle.
pub const FALL_MAX_M_S: f32 = 1.5;
/// Acceleration of free fall \[m/s2\].
const GRAVITY_M_S2: f32 = 9.81;

/// Compares the vehicle's vertical motion with a free fall.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FallCheck {
    /// Vertical velocity when the rotors last carried the vehicle \[m/s\].
    carried_m_s: f32,
    /// Speed that a fall would have gained since \[m/s\].
    fall_m_s: f32,
}

impl FallCheck {
    /// Processes a tick in which the rotors gave this share of the usual thrust. Returns true if the vehicle should be
    /// falling by now, and is not.
    pub fn stands(&mut self, velocity_m_s: &Vector3<f32>, thrust_share: f32, dt_s: f32) -> bool {
        if thrust_share > CARRY_SHARE {
            *self = FallCheck { carried_m_s: velocity_m_s.z, fall_m_s: 0.0 };
            return false;
        }
        // The usual thrust carries the weight. The missing share lets the vehicle fall.
        self.fall_m_s += dt_s * GRAVITY_M_S2 * (1.0 - thrust_share);
        let falls_m_s = self.carried_m_s - velocity_m_s.z;
        self.fall_m_s > FALL_M_S && falls_m_s < FALL_SHARE * self.fall_m_s && abs_max(velocity_m_s) <= FALL_MAX_M_S
    }
}

//! Whether a vehicle stands on something, by its inertial sensor: one that its rotors do not carry, and that does not
//! fall. This shows the ground within half a second, also if the estimated velocity is off by tenths of a metre per
//! second, but of a tracker that may have frozen it would show nothing. Not in the paper.

use crate::landing::CARRY_SHARE;
use afbc_control::math::abs_max;
use nalgebra::Vector3;

/// Speed that a falling vehicle would have gained when one that has gained less than this share of it stands on the
/// ground \[m/s\]. Rotors that follow within 0.1 s, the slowest, leave a falling one 1 m/s short of it.
pub const FALL_M_S: f32 = 3.0;
/// That share.
pub const FALL_SHARE: f32 = 0.5;
/// Speed along each axis up to which that counts: faster, drag may carry a vehicle \[m/s\].
pub const FALL_MAX_M_S: f32 = 1.5;
/// Acceleration of free fall \[m/s2\].
const GRAVITY_M_S2: f32 = 9.81;

/// Compares a fall with what it should be.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FallCheck {
    /// Vertical velocity when the rotors carried the vehicle last \[m/s\].
    carried_m_s: f32,
    /// Speed that it would have gained since in falling \[m/s\].
    fall_m_s: f32,
}

impl FallCheck {
    /// Processes a tick in which the rotors gave this share of the usual thrust; true if the vehicle should fall by
    /// now, and does not.
    pub fn stands(&mut self, velocity_m_s: &Vector3<f32>, thrust_share: f32, dt_s: f32) -> bool {
        if thrust_share > CARRY_SHARE {
            *self = FallCheck { carried_m_s: velocity_m_s.z, fall_m_s: 0.0 };
            return false;
        }
        // The usual thrust carries the weight: as much of it as is missing lets the vehicle fall.
        self.fall_m_s += dt_s * GRAVITY_M_S2 * (1.0 - thrust_share);
        let falls_m_s = self.carried_m_s - velocity_m_s.z;
        self.fall_m_s > FALL_M_S && falls_m_s < FALL_SHARE * self.fall_m_s && abs_max(velocity_m_s) <= FALL_MAX_M_S
    }
}

//! Limits on the demand of the position loops.

use afbc_control::math;
use afbc_types::Parameters;
use nalgebra::Vector3;

/// Smallest vertical part of the specific force, as a share of gravity, so that the thrust always points up and defines
/// an attitude.
const VERTICAL_MIN: f32 = 0.1;
/// Largest vertical part of the specific force, as a share of the rotors' largest thrust per mass. The rest remains for
/// attitude and sideways acceleration.
const VERTICAL_MAX: f32 = 0.9;

/// Bounds of the specific force, the thrust vector per mass in the earth frame \[m/s2\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpecificForceLimits {
    gravity_m_s2: f32,
    vertical_min_m_s2: f32,
    vertical_max_m_s2: f32,
    max_m_s2: f32,
    tan_tilt: f32,
}

impl SpecificForceLimits {
    /// Creates the bounds for a vehicle whose rotors give `thrust_max_n` together. Parameters and largest tilt must be
    /// valid.
    pub fn new(vehicle: &Parameters, thrust_max_n: f32, tilt_max_rad: f32) -> Self {
        let vertical_min_m_s2 = VERTICAL_MIN * vehicle.gravity_m_s2;
        // Even a vehicle whose rotors cannot lift it must have valid bounds.
        let max_m_s2 = (thrust_max_n / vehicle.mass_kg).max(2.0 * vertical_min_m_s2);
        SpecificForceLimits {
            gravity_m_s2: vehicle.gravity_m_s2,
            vertical_min_m_s2,
            vertical_max_m_s2: VERTICAL_MAX * max_m_s2,
            max_m_s2,
            tan_tilt: math::sin(tilt_max_rad) / math::cos(tilt_max_rad),
        }
    }

    /// Returns the specific force that balances gravity \[m/s2\].
    #[inline]
    pub fn gravity(&self) -> Vector3<f32> {
        Vector3::new(0.0, 0.0, self.gravity_m_s2)
    }

    /// Returns the vertical part of a specific force, limited to between 10 % of gravity and 90 % of the rotors'
    /// largest thrust.
    #[inline]
    pub(crate) fn vertical(&self, vertical_m_s2: f32) -> f32 {
        vertical_m_s2.max(self.vertical_min_m_s2).min(self.vertical_max_m_s2)
    }

    /// Returns the closest allowed specific force. Height has priority over sideways acceleration: first, the vertical
    /// part is limited to between 10 % of gravity and 90 % of the rotors' largest thrust. Then tilt and length are
    /// limited. The result always points up.
    #[inline]
    pub fn apply(&self, specific_force: &Vector3<f32>) -> Vector3<f32> {
        let vertical = self.vertical(specific_force.z);
        // The vertical part is at most 90 % of the maximum, so the root's argument is positive.
        let left_over = math::sqrt(self.max_m_s2 * self.max_m_s2 - vertical * vertical);
        let bounded = horizontally(specific_force, left_over.min(self.tan_tilt * vertical));
        Vector3::new(bounded.x, bounded.y, vertical)
    }
}

/// Returns `v` with its horizontal part shortened to at most `max`.
#[inline]
pub(crate) fn horizontally(v: &Vector3<f32>, max: f32) -> Vector3<f32> {
    let length = math::sqrt(v.x * v.x + v.y * v.y);
    if length > max { Vector3::new(v.x * (max / length), v.y * (max / length), v.z) } else { *v }
}

/// Returns `v` with its horizontal part shortened to at most `max` and its vertical part clipped to `max`.
#[inline]
pub(crate) fn cylinder(v: &Vector3<f32>, max: f32) -> Vector3<f32> {
    let v = horizontally(v, max);
    Vector3::new(v.x, v.y, v.z.max(-max).min(max))
}

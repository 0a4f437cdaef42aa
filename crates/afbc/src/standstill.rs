//! Detector of a vehicle that stands on the ground, where its errors must not be learnt. Not in the paper; similar to
//! land detectors of autopilots: in the air, a vehicle whose law demands too little thrust soon moves too fast to be
//! standing. (The thrust produced is no indication, since roll and pitch have priority over thrust and may increase
//! it.)
//!
//! The flight core's land detector is separate: it knows the commands to the rotors but not the law's demands, and
//! disarms, so it takes a second to be sure. This detector only stops the adaptation, and takes 0.2 s.
//!
//! A vehicle that takes off touches the ground for longer than it stands: its feet hold it while its rotors carry most
//! of it, and give way at once. What they hold against is no wind and no weak rotor, and an observer that has made up
//! for it tips the vehicle over when they let go; likewise a tilt that the law has asked for in vain while the wind
//! pushed. So a vehicle touches the ground until it has risen from where it stood, and is asked to tilt little until
//! then. Nor may it stop at once by all of its tilt what the wind has pushed it along: that costs the height that it
//! lacks. It may tilt as far as it has risen.

use afbc_control::math;
use afbc_types::State;

/// Share of the weight below which the demanded thrust does not carry the vehicle.
pub const LIFT_SHARE: f32 = 0.4;
/// Speed along each axis below which the vehicle is at rest \[m/s\].
pub const STILL_M_S: f32 = 0.3;
/// Speed along an axis at which a vehicle no longer stands \[m/s\]: more than rocking on its feet, and reached in 0.1 s
/// of falling.
pub const MOVING_M_S: f32 = 0.5;
/// Time for which both must last \[s\].
pub const STILL_S: f32 = 0.2;
/// Change of height at which a vehicle has left the ground \[m\].
pub const LEFT_M: f32 = 0.05;
/// Tangent of the largest tilt that is asked of a vehicle on its feet: 12 degrees, as autopilots have it.
const TOUCHING_TAN: f32 = 0.21;
/// By how much that grows with the height above where it stood \[1/m\], and from which height on it is free \[m\].
const TAN_PER_M: f32 = 1.0;
const FREE_M: f32 = 1.0;
/// Time after which a vehicle whose rotors carry it no longer touches the ground, wherever it is, and is free \[s\].
pub const IN_AIR_S: f32 = 3.0;

/// Detector of a vehicle that stands on the ground, or touches it. It begins in the air.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Standstill {
    still_s: f32,
    /// None in the air.
    low: Option<Low>,
}

/// A vehicle that touches the ground, or has just left it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Low {
    /// Height at which it stood \[m\]; not known before the first step.
    height_m: Option<f32>,
    /// Time since then \[s\].
    since_s: f32,
    /// How far it has risen, once it has left the ground \[m\]; negative while it touches.
    risen_m: f32,
}

impl Standstill {
    /// A vehicle that stands on the ground, from where it is to take off.
    pub fn land(&mut self) {
        self.low = Some(Low { height_m: None, since_s: 0.0, risen_m: -1.0 });
    }

    /// Processes one step, with the demanded U4 \[N\].
    #[inline]
    pub fn advance(&mut self, thrust_n: f32, weight_n: f32, state: &State, dt_s: f32) {
        let slower = |speed_max| state.velocity_m_s.iter().all(|v| v.abs() < speed_max);
        let speed_max = if self.stands() { MOVING_M_S } else { STILL_M_S };
        self.still_s = if thrust_n < LIFT_SHARE * weight_n && slower(speed_max) { self.still_s + dt_s } else { 0.0 };
        // In every step anew: what counts is the height at which it stood last.
        if self.stands() {
            self.land();
        }
        if let Some(Low { height_m, since_s, risen_m }) = &mut self.low {
            let (z_m, climb_m_s) = (state.position_m.z, state.velocity_m_s.z);
            let above_m = (z_m - *height_m.get_or_insert(z_m)).abs();
            *since_s += dt_s;
            // Sideways it may slide in the wind.
            if *risen_m >= 0.0 || above_m > LEFT_M || climb_m_s > MOVING_M_S {
                *risen_m = above_m;
            }
            if above_m > FREE_M || *since_s > IN_AIR_S || climb_m_s < -MOVING_M_S {
                self.low = None;
            }
        }
    }

    /// True if the vehicle stands on the ground.
    #[inline]
    pub fn stands(&self) -> bool {
        self.still_s > STILL_S
    }

    /// True if the vehicle may touch the ground: it has not left where it stood.
    #[inline]
    pub fn touches(&self) -> bool {
        self.low.is_some_and(|low| low.risen_m < 0.0)
    }

    /// Returns the tangent of the largest tilt that may be asked of it; infinite in the air.
    #[inline]
    pub fn tilt_max_tan(&self) -> f32 {
        self.low.map_or(f32::INFINITY, |low| TOUCHING_TAN + TAN_PER_M * math::max(low.risen_m, 0.0))
    }
}

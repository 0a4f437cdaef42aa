//! Detects a vehicle that stands on the ground, where errors must not be learnt. Not in the paper. It works like the
//! land detectors of autopilots: in the air, a vehicle whose law demands too little thrust soon moves too fast to be
//! standing. (The produced thrust is no indication: roll and pitch have priority over thrust and may increase it.)
//!
//! The flight core's land detector is separate. It knows the commands to the rotors but not the law's demands, and
//! disarms, so it takes a second to be sure. This detector only stops the adaptation, and takes 0.2 s.
//!
//! During take-off, a vehicle touches the ground for longer than it stands: its feet hold it while the rotors carry
//! most of the weight, and then give way at once. Their force is neither wind nor weak rotors. An observer that has
//! compensated it tips the vehicle over when the feet let go, as does a tilt demanded in vain against the wind. So the
//! vehicle counts as touching the ground until it has risen from where it stood, and only a small tilt is allowed until
//! then. Nor may it use its full tilt at once to stop a drift that the wind caused, because that costs height that it
//! does not have. The allowed tilt grows with the height.
//!
//! A landing is the same in reverse. The force of the feet, observed as any other, would take the thrust away while the
//! feet's moments are observed, too, and the vehicle would tip over before it counts as standing. So a vehicle touches
//! the ground as soon as it does not follow its descent, although its law demands little thrust, because something
//! pushes it up. PX4's land detector has ground contact in the same case, by descent and motion.

use afbc_control::math;
use afbc_types::State;

/// The demanded thrust does not carry the vehicle below this share of the weight.
pub const LIFT_SHARE: f32 = 0.4;
/// A vehicle at rest is slower than this along each axis \[m/s\].
pub const STILL_M_S: f32 = 0.3;
/// A standing vehicle no longer stands above this speed along an axis \[m/s\]: more than rocking on its feet, and
/// reached in 0.1 s of falling.
pub const MOVING_M_S: f32 = 0.5;
/// Time for which little thrust and rest must last \[s\].
pub const STILL_S: f32 = 0.2;
/// Change of height at which the vehicle has left the ground \[m\].
pub const LEFT_M: f32 = 0.05;
/// Downward speed of the reference above which it descends \[m/s\].
pub const SINKS_M_S: f32 = 0.2;
/// Share of the reference's speed below which the vehicle does not follow its descent.
pub const STOPPED_SHARE: f32 = 0.5;
/// Observed acceleration upwards from which something holds a vehicle that does not follow its descent \[m/s2\].
pub const PUSHED_M_S2: f32 = 3.0;
/// Tangent of the largest tilt on the ground: 12 degrees, as in other autopilots.
const TOUCHING_TAN: f32 = 0.21;
/// Growth of that tangent with the height above the ground \[1/m\], and height from which the tilt is free \[m\].
const TAN_PER_M: f32 = 1.0;
const FREE_M: f32 = 1.0;
/// Time after which a vehicle that its rotors carry no longer touches the ground, at any height, and its tilt is free
/// \[s\].
pub const IN_AIR_S: f32 = 3.0;

/// Detector of a vehicle that stands on the ground or touches it. It starts in the air.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StandstillDetector {
    still_s: f32,
    /// Take-off in progress, `None` in the air.
    ground_contact: Option<GroundContact>,
}

/// A vehicle that touches the ground or has just left it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct GroundContact {
    /// Height at which the vehicle last stood \[m\], `None` before the first step.
    height_m: Option<f32>,
    /// Time since the vehicle last stood \[s\].
    since_s: f32,
    /// Height above the ground after leaving it \[m\], negative while the vehicle touches it.
    risen_m: f32,
}

impl StandstillDetector {
    /// Sets the vehicle as standing on the ground, before a take-off.
    pub fn land(&mut self) {
        self.ground_contact = Some(GroundContact { height_m: None, since_s: 0.0, risen_m: -1.0 });
    }

    /// Processes one step with the demanded U4 and the weight \[N\], the reference's velocity \[m/s\] and the observed
    /// acceleration \[m/s2\], both along z.
    #[inline]
    pub fn advance(
        &mut self,
        [thrust_n, weight_n]: [f32; 2],
        state: &State,
        [reference_m_s, pushed_m_s2]: [f32; 2],
        dt_s: f32,
    ) {
        let slower = |speed_max| state.velocity_m_s.iter().all(|v| v.abs() < speed_max);
        let speed_max = if self.is_standing() { MOVING_M_S } else { STILL_M_S };
        let lacks_lift = thrust_n < LIFT_SHARE * weight_n;
        self.still_s = if lacks_lift && slower(speed_max) { self.still_s + dt_s } else { 0.0 };
        let is_stopped = || reference_m_s < -SINKS_M_S && state.velocity_m_s.z > STOPPED_SHARE * reference_m_s;
        let has_touched = pushed_m_s2 > PUSHED_M_S2 && lacks_lift && is_stopped();
        // A standing vehicle is landed anew in every step, so that its height counts from where it stood last.
        if self.is_standing() || has_touched {
            self.land();
        }
        if let Some(GroundContact { height_m, since_s, risen_m }) = &mut self.ground_contact {
            let (z_m, climb_m_s) = (state.position_m.z, state.velocity_m_s.z);
            let above_m = (z_m - *height_m.get_or_insert(z_m)).abs();
            *since_s += dt_s;
            // Sideways motion does not count: the vehicle may slide in the wind.
            if *risen_m >= 0.0 || above_m > LEFT_M || climb_m_s > MOVING_M_S {
                *risen_m = above_m;
            }
            if above_m > FREE_M || *since_s > IN_AIR_S || climb_m_s < -MOVING_M_S {
                self.ground_contact = None;
            }
        }
    }

    /// Returns true if the vehicle stands on the ground.
    #[inline]
    pub fn is_standing(&self) -> bool {
        self.still_s > STILL_S
    }

    /// Returns true if the vehicle may touch the ground: it has not left the place where it stood.
    #[inline]
    pub fn is_touching_ground(&self) -> bool {
        self.ground_contact.is_some_and(|low| low.risen_m < 0.0)
    }

    /// Returns the tangent of the largest tilt allowed, infinite in the air.
    #[inline]
    pub fn tilt_max_tan(&self) -> f32 {
        self.ground_contact.map_or(f32::INFINITY, |low| TOUCHING_TAN + TAN_PER_M * math::max(low.risen_m, 0.0))
    }
}

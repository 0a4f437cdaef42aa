//! What is known of the inputs, ahead by the lag that their filters leave. Not in the paper.
//!
//! The lead T of the [filters](afbc_control::smoothing) is chosen for what is fed back, whose noise it amplifies. Of
//! the rotors' lag and that of the filters themselves it leaves
//!
//! ```text
//! d = lag + 2/w - T          at least 0
//! ```
//!
//! What follows from the reference has little noise, and is commanded that much earlier: a = R_e dOmega_d/dt of
//! [roll and pitch](crate::rotation) as a + d da/dt, with a low-pass for the derivative, and the thrust by how that of
//! the reference changes. Yaw, whose U3 has no lead and a lag to match, stays as it is: so much lead would drive its
//! rotors in every step of the other two.

use afbc_control::{Smoothing, math};
use nalgebra::Vector2;

/// The constants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ahead {
    /// d of roll and pitch over what the low-pass trails by.
    lead: f32,
    /// Share of the low-pass that is replaced per step.
    share: f32,
    /// d of the thrust \[s\].
    pub thrust_s: f32,
}

impl Ahead {
    /// Makes it for rotors and filters with these lags, and a low-pass of bandwidth `bandwidth_rad_s`, advanced every
    /// `dt_s` seconds.
    pub fn new(lag_s: f32, smoothing: &Smoothing, bandwidth_rad_s: f32, dt_s: f32) -> Self {
        let Smoothing { smooth_tilt_rad_s, smooth_lift_rad_s, lead_s, .. } = *smoothing;
        // Without a filter there is no lead either: all of the rotors' lag is left.
        let left = |w: f32| if w > 0.0 { math::max(lag_s + 2.0 / w - lead_s, 0.0) } else { lag_s };
        let share = 1.0 - math::exp(-bandwidth_rad_s * dt_s);
        Ahead {
            // What rises by s trails by s dt / share.
            lead: left(smooth_tilt_rad_s) * share / dt_s,
            share,
            thrust_s: left(smooth_lift_rad_s),
        }
    }

    /// Returns by what the angular accelerations of roll and pitch will have changed when they take effect \[rad/s2\],
    /// and advances the low-pass by one step.
    #[inline(always)]
    pub fn advance(&self, late: &mut Option<Vector2<f32>>, accelerations_rad_s2: &Vector2<f32>) -> Vector2<f32> {
        // The first counts as having stood before: a law that takes over does not jump.
        let before = late.unwrap_or(*accelerations_rad_s2);
        *late = Some((before + (accelerations_rad_s2 - before) * self.share).map(math::settled));
        (accelerations_rad_s2 - before) * self.lead
    }
}

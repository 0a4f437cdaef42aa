//! Commands the predictable part of the inputs earlier, by the lag that the input filters leave. Not in the paper.
//!
//! The lead T of the [filters](afbc_control::smoothing) is chosen for feedback signals, whose noise it amplifies. It
//! compensates only a part of the lag of rotors and filters, and leaves
//!
//! ```text
//! d = lag + 2/w - T          at least 0
//! ```
//!
//! Signals from the reference have little noise and are commanded earlier by d. The angular acceleration a = R_e
//! dOmega_d/dt of [roll and pitch](crate::rotation) becomes a + d da/dt, with a low-pass for the derivative. The thrust
//! is shifted by d times the derivative of the reference's thrust. Yaw (U3) stays unshifted: it has no lead and a large
//! lag, and shifting it so far would command its rotors hard in every step of roll and pitch.

use afbc_control::{Smoothing, math};
use nalgebra::Vector2;

/// Constants of the shift.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DelayCompensation {
    /// d of roll and pitch, divided by the delay of the low-pass.
    lead: f32,
    /// Share of the distance to its input that the low-pass covers per step.
    share: f32,
    /// d of the thrust \[s\].
    pub thrust_s: f32,
}

impl DelayCompensation {
    /// Creates the constants for rotors and filters with these lags and a low-pass of bandwidth `bandwidth_rad_s`,
    /// advanced every `dt_s` seconds.
    pub fn new(lag_s: f32, smoothing: &Smoothing, bandwidth_rad_s: f32, dt_s: f32) -> Self {
        let Smoothing { smooth_tilt_rad_s, smooth_lift_rad_s, lead_s, .. } = *smoothing;
        // Without a filter there is no lead, so all of the rotors' lag is left.
        let left = |w: f32| if w > 0.0 { math::max(lag_s + 2.0 / w - lead_s, 0.0) } else { lag_s };
        let share = 1.0 - math::exp(-bandwidth_rad_s * dt_s);
        DelayCompensation {
            // A low-pass lags behind a ramp of slope s by s dt / share.
            lead: left(smooth_tilt_rad_s) * share / dt_s,
            share,
            thrust_s: left(smooth_lift_rad_s),
        }
    }

    /// Returns the predicted change of the angular accelerations of roll and pitch until they take effect \[rad/s2\],
    /// and advances the low-pass by one step.
    #[inline(always)]
    pub fn advance(&self, late: &mut Option<Vector2<f32>>, accelerations_rad_s2: &Vector2<f32>) -> Vector2<f32> {
        // The low-pass starts at its first input, so that a law that takes over does not jump.
        let before = late.unwrap_or(*accelerations_rad_s2);
        *late = Some((before + (accelerations_rad_s2 - before) * self.share).map(math::settled));
        (accelerations_rad_s2 - before) * self.lead
    }
}

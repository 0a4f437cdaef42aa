//! Effort factor on U1..U3 for rotors that are weaker or stronger than the model's, because such rotors also turn the
//! vehicle less or more. Not in the paper.
//!
//! The factor is the learnt hover thrust divided by the weight. A heavier vehicle also raises it, although it may be no
//! harder to turn, so the factor is bounded.

use afbc_control::math;

/// Smallest effort factor.
pub const EFFORT_MIN: f32 = 0.7;
/// Largest effort factor.
pub const EFFORT_MAX: f32 = 1.8;
/// Bandwidth with which the factor follows the learnt hover thrust \[rad/s\], so that a hand-over between laws makes no
/// jump.
const BANDWIDTH_RAD_S: f32 = 5.0;

/// Filter of the effort factor. Its memory is the factor minus one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    inverse_weight: f32,
    /// Share of the factor that is replaced per step.
    share: f32,
}

impl Effort {
    /// Creates the filter for a vehicle of this weight, advanced every `dt_s` seconds.
    pub fn new(weight_n: f32, dt_s: f32) -> Self {
        Effort { inverse_weight: 1.0 / weight_n, share: 1.0 - math::exp(-BANDWIDTH_RAD_S * dt_s) }
    }

    /// Returns the factor for this learnt hover thrust, and advances the filter by one step.
    #[inline(always)]
    pub fn advance(&self, more: &mut f32, hover_n: f32) -> f32 {
        let target = math::min(math::max(hover_n * self.inverse_weight, EFFORT_MIN), EFFORT_MAX);
        *more = math::settled(*more + (target - 1.0 - *more) * self.share);
        1.0 + *more
    }
}

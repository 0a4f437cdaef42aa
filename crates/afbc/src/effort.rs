//! Factor of U1..U3 for rotors that are weaker or stronger than the model's: they turn the vehicle by as much less as
//! they lift. Not in the paper.
//!
//! What they give shows in the learnt hover thrust over the weight. A heavier vehicle, which may be no harder to turn,
//! takes more of it as well, so the factor is bounded.

use afbc_control::math;

/// Smallest factor.
pub const EFFORT_MIN: f32 = 0.7;
/// Largest factor.
pub const EFFORT_MAX: f32 = 1.8;
/// Bandwidth with which the factor follows the learnt hover thrust \[rad/s\]: no hand-over between laws makes it jump.
const BANDWIDTH_RAD_S: f32 = 5.0;

/// The factor's filter; its memory is the factor less one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    inverse_weight: f32,
    /// Share that is replaced per step.
    share: f32,
}

impl Effort {
    /// Makes the filter for a vehicle of this weight, advanced every `dt_s` seconds.
    pub fn new(weight_n: f32, dt_s: f32) -> Self {
        Effort { inverse_weight: 1.0 / weight_n, share: 1.0 - math::exp(-BANDWIDTH_RAD_S * dt_s) }
    }

    /// Returns the factor for this learnt hover thrust, and advances by one step.
    #[inline(always)]
    pub fn advance(&self, more: &mut f32, hover_n: f32) -> f32 {
        let target = math::min(math::max(hover_n * self.inverse_weight, EFFORT_MIN), EFFORT_MAX);
        *more = math::settled(*more + (target - 1.0 - *more) * self.share);
        1.0 + *more
    }
}

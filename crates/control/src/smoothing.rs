//! Low-pass filters on the inputs, against noise of the measurements. Not in the paper.
//!
//! ```text
//! dU/dt = w (U_law - U)
//! ```
//!
//! White noise changes U by sqrt(k^2 / (2 - k)) times as much from step to step as without the filter, k = 1 - exp(-w
//! dt): a fifth at w = 300 rad/s, for 3 ms of lag beside the rotors' 20 ms.

use crate::math;
use afbc_types::{Declared, Inputs, OutOfRange, parameters};

parameters! {
    /// Bandwidths w of the filters; 0 for none.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
    #[cfg_attr(feature = "defmt", derive(defmt::Format))]
    pub struct Smoothing {
        /// Bandwidth of the filters on U1 and U2; 0 for none.
        #[parameter(SMOOTH_TILT, "rad/s", 0.0..=1e4, tuned)]
        pub smooth_tilt_rad_s: f32 = 0.0,
        /// Bandwidth of the filter on U3; 0 for none.
        #[parameter(SMOOTH_YAW, "rad/s", 0.0..=1e4, tuned)]
        pub smooth_yaw_rad_s: f32 = 0.0,
        /// Bandwidth of the filter on U4; 0 for none.
        #[parameter(SMOOTH_LIFT, "rad/s", 0.0..=1e4, tuned)]
        pub smooth_lift_rad_s: f32 = 0.0,
    }
}

/// The filters. Constant; their memory is the last output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smoother {
    /// Share k of U1 and U2, of U3 and of U4 that is replaced per step; none without any filter.
    shares: Option<[f32; 3]>,
}

impl Smoother {
    /// Makes the filters, advanced every `dt_s` seconds (valid in [`crate::Settings::DT`]).
    ///
    /// # Errors
    /// The first bandwidth out of range.
    pub fn new(smoothing: &Smoothing, dt_s: f32) -> Result<Self, OutOfRange> {
        smoothing.validate()?;
        let bandwidths = [smoothing.smooth_tilt_rad_s, smoothing.smooth_yaw_rad_s, smoothing.smooth_lift_rad_s];
        let share = |w: f32| if w > 0.0 { 1.0 - math::exp(-w * dt_s) } else { 1.0 };
        Ok(Smoother { shares: bandwidths.iter().any(|w| *w > 0.0).then(|| bandwidths.map(share)) })
    }

    /// Returns the filtered inputs; the first, and those that are not finite, are returned as they are.
    #[inline]
    pub fn advance(&self, last: &mut Option<Inputs>, inputs: &Inputs) -> Inputs {
        let Some([tilt, yaw, lift]) = self.shares else { return *inputs };
        let next = last.map_or(*inputs, |last| {
            let towards = |from: f32, to: f32, share: f32| from + (to - from) * share;
            Inputs {
                roll_n: towards(last.roll_n, inputs.roll_n, tilt),
                pitch_n: towards(last.pitch_n, inputs.pitch_n, tilt),
                yaw_n: towards(last.yaw_n, inputs.yaw_n, yaw),
                thrust_n: towards(last.thrust_n, inputs.thrust_n, lift),
            }
        });
        let finite = (next.roll_n + next.pitch_n + next.yaw_n + next.thrust_n).is_finite();
        *last = finite.then_some(next);
        if finite { next } else { *inputs }
    }
}

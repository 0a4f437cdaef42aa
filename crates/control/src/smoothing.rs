//! Filters on the inputs: a low-pass against noise of the measurements, and a lead that makes up for the rotors' lag.
//! Not in the paper.
//!
//! ```text
//! U = (1 + T s) / (1 + s/w)^2 U_law        without T for U3
//! ```
//!
//! At w = 300 rad/s and steps of 1 ms, white noise changes U from step to step by 6 % of what it does without the
//! low-pass, for 7 ms of lag beside the rotors' 20 ms. The lead takes T of lag away.

use crate::math;
use afbc_types::{Declared, Inputs, OutOfRange, parameters};

parameters! {
    /// Bandwidths w of the filters, 0 for none, and their lead.
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
        /// T: lead of the filters on U1, U2 and U4.
        #[parameter(LEAD, "s", 0.0..=0.5, tuned)]
        pub lead_s: f32 = 0.0,
    }
}

impl Smoothing {
    /// Hand-tuned for rotors that lag by 20 ms, from which a search starts.
    pub const BY_HAND: Self =
        Smoothing { smooth_tilt_rad_s: 200.0, smooth_yaw_rad_s: 120.0, smooth_lift_rad_s: 120.0, lead_s: 0.02 };

    /// Returns the filters of a vehicle that is `slowness` times slower.
    #[must_use]
    pub fn slowed(self, slowness: f32) -> Self {
        Smoothing {
            smooth_tilt_rad_s: self.smooth_tilt_rad_s / slowness,
            smooth_yaw_rad_s: self.smooth_yaw_rad_s / slowness,
            smooth_lift_rad_s: self.smooth_lift_rad_s / slowness,
            lead_s: self.lead_s * slowness,
        }
    }
}

/// The filters. Constant; everything that changes in flight is in [`Smoothed`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smoother {
    /// Share k of U1 and U2, of U3 and of U4 that is replaced per step; none without any filter.
    shares: Option<[f32; 3]>,
    /// T w of U1 and U2, and of U4; 0 without a filter.
    leads: [f32; 2],
}

/// Memory of the filters: the inputs behind the first low-pass, and behind both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smoothed {
    once: Inputs,
    twice: Inputs,
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
        Ok(Smoother {
            shares: bandwidths.iter().any(|w| *w > 0.0).then(|| bandwidths.map(share)),
            leads: [smoothing.smooth_tilt_rad_s, smoothing.smooth_lift_rad_s].map(|w| w * smoothing.lead_s),
        })
    }

    /// Returns the filtered inputs; the first, and those that are not finite, are returned as they are.
    // Always inlined: what is returned in memory is read back before it has been written.
    #[inline(always)]
    pub fn advance(&self, last: &mut Option<Smoothed>, inputs: &Inputs) -> Inputs {
        let Some([tilt, yaw, lift]) = self.shares else { return *inputs };
        let towards = |from: f32, to: f32, share: f32| math::settled(from + (to - from) * share);
        let filtered = |from: &Inputs, to: &Inputs| Inputs {
            roll_n: towards(from.roll_n, to.roll_n, tilt),
            pitch_n: towards(from.pitch_n, to.pitch_n, tilt),
            yaw_n: towards(from.yaw_n, to.yaw_n, yaw),
            thrust_n: towards(from.thrust_n, to.thrust_n, lift),
        };
        let Smoothed { once, twice } = last.get_or_insert(Smoothed { once: *inputs, twice: *inputs });
        *once = filtered(once, inputs);
        // (1 + T s) / (1 + s/w) = low-pass + T w (1 - low-pass)
        let [tilt_lead, lift_lead] = self.leads;
        let led = Inputs {
            roll_n: towards(once.roll_n, inputs.roll_n, tilt_lead),
            pitch_n: towards(once.pitch_n, inputs.pitch_n, tilt_lead),
            yaw_n: once.yaw_n,
            thrust_n: towards(once.thrust_n, inputs.thrust_n, lift_lead),
        };
        *twice = filtered(twice, &led);
        let given = *twice;
        // A memory that is not finite would never be finite again.
        if (given.roll_n + given.pitch_n + given.yaw_n + given.thrust_n).is_finite() {
            return given;
        }
        *last = None;
        *inputs
    }
}

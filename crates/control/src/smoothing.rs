//! Filters on the inputs: a low-pass against measurement noise, and a lead that compensates the rotors' lag. Not in the
//! paper.
//!
//! ```text
//! U = (1 + T s) / (1 + s/w)^2 U_law        without T for U3
//! ```
//!
//! At w = 300 rad/s and steps of 1 ms, the low-pass reduces the step-to-step changes of U by white noise to 6 %. It
//! adds 7 ms of lag to the rotors' 20 ms. The lead removes a lag of T.

use crate::math;
use afbc_types::{Declared, Inputs, OutOfRange, parameters};

parameters! {
    /// Bandwidths w and lead T of the filters on the inputs U1 to U4.
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
    /// Hand-tuned filters for rotors that lag by 20 ms, from which a search starts.
    pub const BY_HAND: Self =
        Smoothing { smooth_tilt_rad_s: 200.0, smooth_yaw_rad_s: 120.0, smooth_lift_rad_s: 120.0, lead_s: 0.02 };

    /// Returns the filters for a vehicle that is `slowness` times slower.
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

/// Constants of the filters. The memory is in [`Smoothed`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smoother {
    /// Share of the difference that each low-pass makes up per step, for U1 and U2, for U3, and for U4; `None` without
    /// any filter.
    shares: Option<[f32; 3]>,
    /// T w for U1 and U2, and for U4; 0 without a filter.
    leads: [f32; 2],
}

/// Memory of the filters: the inputs after the first low-pass, and after both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smoothed {
    once: Inputs,
    twice: Inputs,
}

impl Smoother {
    /// Makes the filters with a time step of `dt_s` seconds, which must be within [`crate::Settings::DT`].
    ///
    /// # Errors
    /// The first bandwidth or lead out of range.
    pub fn new(smoothing: &Smoothing, dt_s: f32) -> Result<Self, OutOfRange> {
        smoothing.validate()?;
        let bandwidths = [smoothing.smooth_tilt_rad_s, smoothing.smooth_yaw_rad_s, smoothing.smooth_lift_rad_s];
        let share = |w: f32| if w > 0.0 { 1.0 - math::exp(-w * dt_s) } else { 1.0 };
        Ok(Smoother {
            shares: bandwidths.iter().any(|w| *w > 0.0).then(|| bandwidths.map(share)),
            leads: [smoothing.smooth_tilt_rad_s, smoothing.smooth_lift_rad_s].map(|w| w * smoothing.lead_s),
        })
    }

    /// Returns the filtered inputs. Returns the first inputs, and inputs that are not finite, unchanged.
    // This function is always inlined: a result returned in memory would be read back before it has been written.
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
        // Clear a memory that is not finite: it would never recover.
        if (given.roll_n + given.pitch_n + given.yaw_n + given.thrust_n).is_finite() {
            return given;
        }
        *last = None;
        *inputs
    }
}

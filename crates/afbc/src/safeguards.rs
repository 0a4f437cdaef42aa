//! Safeguards that bound the estimates and keep the robust term smooth. Not in the paper's law (33), (34).
//!
//! With s = tanh(e_2/epsilon), or e_2/(|e_2| + epsilon) with feed-forward, (33) and (34) become
//!
//! ```text
//! d Theta_hat/dt = gamma e w(x) - sigma Theta_hat,   |Theta_hat| <= Theta_max
//! d delta_hat/dt = eta e s      - sigma delta_hat,   0 <= delta_hat <= delta_max
//! ```
//!
//! * sigma > 0: sigma-modification, Ioannou and Kokotovic 1983. In V' (31) it adds
//!   sigma/gamma Theta_tilde^T Theta_hat <= sigma/2gamma (|Theta*|^2 - |Theta_tilde|^2), the decay that (37) lacks.
//! * Theta_max, delta_max: projection, Pomet and Praly 1992. Never increases V as long as the optimum is within.
//! * Anti-windup ([`Settings::anti_windup`](crate::Settings)): e is e_2, or 0 where an estimate would grow in the
//!   direction of a limit that has been reached.
//!
//! `docs/flight.md` derives the resulting bound.

use afbc_types::parameters;

parameters! {
    /// Safeguards of one subsystem's adaptation; each off by default.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct Safeguards {
        /// sigma: leakage of both estimates.
        #[parameter(SIGMA, "1/s", 0.0..=10.0)]
        pub sigma: f32 = 0.0,
        /// Bound on |Theta_hat|, in the unit of the subsystem's input.
        #[parameter(THETAMAX, "input", 0.0..=1e6)]
        pub theta_max: f32 = 1e6,
        /// Bound on delta_hat, in the unit of the subsystem's input.
        #[parameter(DELTAMAX, "input", 0.0..=1e6, tuned)]
        pub delta_max: f32 = 1e6,
    }
}

impl Safeguards {
    /// No safeguards: the law as printed.
    pub const NONE: Self = Self::DEFAULT;

    /// Returns the adaptation error e for e_2, given the part `unallocated` of the input that could not be allocated.
    #[inline]
    pub(crate) fn adaptation_error(e2: f32, unallocated: f32) -> f32 {
        if e2 * unallocated > 0.0 { 0.0 } else { e2 }
    }
}

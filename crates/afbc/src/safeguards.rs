//! Safeguards that bound the estimates and keep the robust term smooth. Not in the paper's law (33), (34).
//!
//! With e = e_2 after the dead zone and s = tanh(e_2/epsilon), (33) and (34) become
//!
//! ```text
//! d Theta_hat/dt = gamma e w(x) - (sigma + kappa |e_2|) Theta_hat,   |Theta_hat| <= Theta_max
//! d delta_hat/dt = eta e s      - (sigma + kappa |e_2|) delta_hat,   0 <= delta_hat <= delta_max
//! ```
//!
//! * sigma > 0: sigma-modification, Ioannou and Kokotovic 1983. In V' (31) it adds
//!   sigma/gamma Theta_tilde^T Theta_hat <= sigma/2gamma (|Theta*|^2 - |Theta_tilde|^2), the decay that (37) lacks.
//! * kappa > 0: e-modification, Narendra and Annaswamy 1987. As sigma, but only while there is an error.
//! * Theta_max, delta_max: projection, Pomet and Praly 1992. Never increases V as long as the optimum is within.
//! * Dead zone: no adaptation to errors explained by noise, Peterson and Narendra 1982.
//! * Anti-windup ([`Settings::anti_windup`](crate::Settings)): an estimate does not grow in the direction of a limit
//!   that has been reached.
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
        /// kappa: leakage that grows with the error.
        #[parameter(KAPPA, "1/s per m/s or rad/s", 0.0..=100.0)]
        pub kappa: f32 = 0.0,
        /// Bound on |Theta_hat|, in the unit of the subsystem's input.
        #[parameter(THETAMAX, "input", 0.0..=1e6)]
        pub theta_max: f32 = 1e6,
        /// Bound on delta_hat, in the unit of the subsystem's input.
        #[parameter(DELTAMAX, "input", 0.0..=1e6, tuned)]
        pub delta_max: f32 = 1e6,
        /// Largest |e_2| without adaptation.
        #[parameter(DEADZONE, "m/s or rad/s", 0.0..=10.0)]
        pub dead_zone: f32 = 0.0,
    }
}

impl Safeguards {
    /// No safeguards: the law as printed.
    pub const NONE: Self = Self::DEFAULT;

    /// Returns the adaptation error e for e_2, given the part `unallocated` of the input that could not be allocated.
    #[inline]
    pub(crate) fn adaptation_error(&self, e2: f32, unallocated: f32) -> f32 {
        if e2 * unallocated > 0.0 {
            0.0
        } else if e2 > self.dead_zone {
            e2 - self.dead_zone
        } else if e2 < -self.dead_zone {
            e2 + self.dead_zone
        } else {
            0.0
        }
    }

    /// Returns sigma + kappa |e_2| \[1/s\].
    #[inline]
    pub(crate) fn leakage(&self, e2: f32) -> f32 {
        self.sigma + self.kappa * e2.abs()
    }
}

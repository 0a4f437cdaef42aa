//! Backstepping of one second-order subsystem (7), and the classical controller that is the paper's baseline.

use crate::law::{StepContext, SubsystemLaw, SubsystemTracking};
use crate::model::{Dynamics, ModelConstants};
use afbc_control::Errors;
use afbc_types::{Axis, Declared, OutOfRange, Parameters, PerAxis, parameters};

/// Returns the ideal law u*_eq (16) for known f, g and dg/dt, with c e_1 in place of e_1.
#[inline]
pub fn ideal(gains: &Gains, errors: &Errors, x1d_ddot: f32, dynamics: &Dynamics) -> f32 {
    let (Gains { alpha1, stiffness, .. }, Errors { e1, e2, .. }) = (*gains, *errors);
    compensated(stiffness * e1 + alpha1 * (e2 - alpha1 * e1) + x1d_ddot, e2, dynamics)
}

/// Returns the input for an acceleration, compensating f and dg/dt as in (16).
#[inline]
fn compensated(acceleration: f32, e2: f32, dynamics: &Dynamics) -> f32 {
    let Dynamics { f, g, g_dot } = *dynamics;
    // Only g_4 changes, so the other subsystems skip the division.
    let drift = if g_dot == 0.0 { 0.0 } else { 0.5 * g_dot / g * e2 };
    (acceleration - f - drift) / g
}

/// Returns [`ideal`]. At the speed limit, where [`SubsystemTracking::errors`] uses the approach speed for e_2, c e_1 +
/// alpha_1 de_1/dt becomes alpha_1 e_2.
#[inline]
pub(crate) fn known(gains: &Gains, tracking: &SubsystemTracking, errors: &Errors, dynamics: &Dynamics) -> f32 {
    if tracking.approach_1_s.is_some() {
        compensated(gains.alpha1 * errors.e2 + tracking.x1d_ddot, errors.e2, dynamics)
    } else {
        ideal(gains, errors, tracking.x1d_ddot, dynamics)
    }
}

/// Returns u_pd (21).
#[inline]
pub fn proportional(alpha2: f32, errors: &Errors) -> f32 {
    alpha2 * errors.e2
}

/// Returns u*_eq + alpha_2 e_2, and the errors.
#[inline]
pub(crate) fn classical(gains: &Gains, tracking: &SubsystemTracking, dynamics: &Dynamics) -> (f32, Errors) {
    let errors = tracking.errors(gains.alpha1);
    (known(gains, tracking, &errors, dynamics) + proportional(gains.alpha2, &errors), errors)
}

parameters! {
    /// The gains of one backstepping subsystem. The defaults are those of Section IV for attitude, x and y.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct Gains {
        /// alpha_1: gain on e_1 in the paper's equation 12.
        #[parameter(ALPHA1, "1/s", 1e-2..=100.0, tuned)]
        pub alpha1: f32 = 1.0,
        /// alpha_2: gain on e_2 in the paper's equation 21.
        #[parameter(ALPHA2, "input per m/s or rad/s", 0.0..=1000.0, tuned)]
        pub alpha2: f32 = 2.0,
        /// c: weight of e_1 in V = c e_1^2/2 + e_2^2/(2g), and therefore in the paper's equation 16. The paper uses 1.
        #[parameter(STIFF, "1/s2", 0.0..=10000.0, tuned)]
        pub stiffness: f32 = 1.0,
    }
}

impl Gains {
    /// Returns the gains of a loop that is `softness` times as fast.
    #[inline(always)]
    #[must_use]
    pub(crate) fn slowed(&self, softness: f32) -> Self {
        Gains {
            alpha1: self.alpha1 * softness,
            alpha2: self.alpha2 * softness,
            stiffness: self.stiffness * (softness * softness),
        }
    }

    /// Returns the approach speed per error \[1/s\] at which the sum of [`known`] and u_pd is zero, for an input with
    /// gain g: the position gain divided by the rate gain.
    pub(crate) fn approach(&self, g: f32) -> f32 {
        let gain = self.alpha2 * g;
        // alpha_1 is positive by its range and the gain is not negative, so the divisor is positive.
        (self.stiffness + self.alpha1 * gain) / (self.alpha1 + gain)
    }
}

/// Classical backstepping: u_i = u*_eq,i + alpha_2i e_2i with the nominal model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Backstepping {
    gains: PerAxis<Gains>,
    model: ModelConstants,
}

impl Backstepping {
    /// Creates the baseline for a vehicle with these nominal parameters.
    ///
    /// # Errors
    /// Returns the first parameter or gain that is out of range.
    pub fn new(vehicle: &Parameters, gains: PerAxis<Gains>) -> Result<Self, OutOfRange> {
        vehicle.validate()?;
        for axis in Axis::ALL {
            gains[axis].validate()?;
        }
        Ok(Backstepping { gains, model: ModelConstants::new(vehicle) })
    }
}

impl SubsystemLaw for Backstepping {
    /// Empty, because a fixed law has no memory.
    type Estimate = ();

    #[inline]
    fn input(&self, axis: Axis, tracking: &SubsystemTracking, context: &StepContext, (): &mut ()) -> (f32, Errors) {
        classical(&self.gains[axis], tracking, &context.dynamics(&self.model, axis))
    }

    fn approach(&self, axis: Axis, _known: Option<&ModelConstants>) -> f32 {
        self.gains[axis].approach(self.model.hover_gain(axis))
    }
}

//! Backstepping with integral action: the fixed-gain fallback law after the [monitor](crate::monitor) has switched off
//! AFBC.
//!
//! ```text
//! u = u*_eq + alpha_2 e_2 + i        di/dt = kappa e_2,  |i| <= i_max
//! ```
//!
//! With V = 1/2 (e_1^2 + e_2^2/g + (i* - i)^2/kappa), V' = -alpha_1 e_1^2 - alpha_2 e_2^2 for any constant disturbance
//! g i*: the integral is (34) with a single rule. Krstic, Kanellakopoulos, Kokotovic, *Nonlinear and Adaptive Control
//! Design*, 1995, section 4.2.

use crate::adaptive;
use crate::backstepping::{self, classical};
use crate::law::{StepContext, SubsystemLaw, SubsystemTracking};
use crate::model::ModelConstants;
use crate::safeguards::Safeguards;
use afbc_control::{Errors, math};
use afbc_types::{Axis, Declared, OutOfRange, Parameters, PerAxis};

/// Gains of one subsystem.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gains {
    /// alpha_1, alpha_2.
    pub backstepping: backstepping::Gains,
    /// kappa, with the range of AFBC's gamma.
    pub integral: f32,
    /// i_max in the unit of the subsystem's input, with the range of AFBC's theta_max.
    pub integral_max: f32,
}

impl From<&adaptive::Gains> for Gains {
    /// Returns gains as fast as AFBC with a single rule, with the same bound.
    fn from(gains: &adaptive::Gains) -> Self {
        Gains { backstepping: gains.backstepping, integral: gains.gamma, integral_max: gains.safeguards.theta_max }
    }
}

/// Memory of one subsystem.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct IntegralMemory {
    /// The integral i.
    pub value: f32,
    /// Input to continue with; the next step chooses i accordingly.
    pub resume: Option<f32>,
    /// For z: the hover thrust U4 that AFBC had estimated before the trip \[N\].
    pub hover_thrust_n: Option<f32>,
}

/// Backstepping with integral action.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IntegralBackstepping {
    gains: PerAxis<Gains>,
    model: ModelConstants,
}

impl IntegralBackstepping {
    /// Creates the law for a vehicle with these nominal parameters.
    ///
    /// # Errors
    /// Returns the first parameter or gain that is out of range.
    pub fn new(vehicle: &Parameters, gains: PerAxis<Gains>) -> Result<Self, OutOfRange> {
        vehicle.validate()?;
        for axis in Axis::ALL {
            let Gains { backstepping, integral, integral_max } = &gains[axis];
            backstepping.validate()?;
            adaptive::Gains::GAMMA.range.check(*integral)?;
            Safeguards::THETAMAX.range.check(*integral_max)?;
        }
        Ok(IntegralBackstepping { gains, model: ModelConstants::new(vehicle) })
    }
}

impl SubsystemLaw for IntegralBackstepping {
    const OBSERVES: bool = true;

    type Estimate = IntegralMemory;

    #[inline]
    fn input(
        &self,
        axis: Axis,
        tracking: &SubsystemTracking,
        context: &StepContext,
        integral: &mut IntegralMemory,
    ) -> (f32, Errors) {
        let Gains { backstepping, integral: kappa, integral_max } = &self.gains[axis];
        let (softness, tracking) = context.softened(axis, tracking);
        let backstepping = backstepping.slowed(softness);
        let (fixed, errors) = classical(&backstepping, &tracking, &context.observed(&self.model, axis));
        if let Some(input) = integral.resume.take() {
            integral.value = input - fixed;
        }
        // The integral is limited where it is used, because the input to resume may also ask for more than the bound.
        let i = math::min(math::max(integral.value, -integral_max), *integral_max);
        let winds_up = errors.e2 * context.unallocated[axis] > 0.0;
        integral.value = if context.adapts(axis) && !winds_up {
            i + kappa * (softness * softness) * errors.e2 * context.dt_s
        } else {
            i
        };
        (fixed + i, errors)
    }

    fn approach(&self, axis: Axis, _: Option<&ModelConstants>) -> f32 {
        self.gains[axis].backstepping.approach(self.model.hover_gain(axis))
    }

    fn hover_thrust_n(&self, z: &IntegralMemory, weight_n: f32, _: f32) -> f32 {
        // The weight plus the integral would include the thrust of manoeuvres.
        z.hover_thrust_n.unwrap_or(weight_n)
    }
}

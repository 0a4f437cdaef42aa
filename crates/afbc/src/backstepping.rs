//! Backstepping of one second-order subsystem (7), and the classical controller that is the paper's baseline.

use crate::law::{Context, Law, Tracking};
use crate::model::{Dynamics, Model};
use afbc_control::{Errors, Estimate};
use afbc_types::{Axis, Declared, OutOfRange, Parameters, PerAxis, parameters};

/// Returns the ideal law u*_eq (16) for known f, g and dg/dt.
#[inline]
pub fn ideal(alpha1: f32, errors: &Errors, x1d_ddot: f32, dynamics: &Dynamics) -> f32 {
    let Errors { e1, e2, .. } = *errors;
    compensated(e1 + alpha1 * (e2 - alpha1 * e1) + x1d_ddot, e2, dynamics)
}

/// Returns the input for an acceleration, with the compensation of f and dg/dt in (16).
#[inline]
fn compensated(acceleration: f32, e2: f32, dynamics: &Dynamics) -> f32 {
    let Dynamics { f, g, g_dot } = *dynamics;
    (acceleration - f - 0.5 * g_dot / g * e2) / g
}

/// Returns u_pd (21).
#[inline]
pub fn proportional(alpha2: f32, errors: &Errors) -> f32 {
    alpha2 * errors.e2
}

/// Returns u*_eq + alpha_2 e_2, and the errors. At the speed limit e_1 is constant, and (16) applies to e_2 alone,
/// whose derivative is d^2 x_1d/dt^2 - f - g u: otherwise -alpha_1^2 e_1 would slow down a vehicle that approaches the
/// limit.
#[inline]
pub(crate) fn classical(gains: &Gains, tracking: &Tracking, dynamics: &Dynamics) -> (f32, Errors) {
    let Gains { alpha1, alpha2 } = *gains;
    let errors = tracking.errors(alpha1);
    let ideal = if tracking.limited {
        compensated(tracking.x1d_ddot, errors.e2, dynamics)
    } else {
        ideal(alpha1, &errors, tracking.x1d_ddot, dynamics)
    };
    (ideal + proportional(alpha2, &errors), errors)
}

parameters! {
    /// The two gains of one backstepping subsystem. The defaults are those of Section IV for attitude, x and y.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Gains {
        /// alpha_1 (12).
        #[parameter(ALPHA1, "1/s", 1e-2..=100.0, tuned)]
        pub alpha1: f32 = 1.0,
        /// alpha_2 (21).
        #[parameter(ALPHA2, "input per m/s or rad/s", 0.0..=1000.0, tuned)]
        pub alpha2: f32 = 2.0,
    }
}

/// Classical backstepping: u_i = u*_eq,i + alpha_2i e_2i with the nominal model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Backstepping {
    gains: PerAxis<Gains>,
    model: Model,
}

impl Backstepping {
    /// Creates the baseline for a vehicle with these nominal parameters.
    ///
    /// # Errors
    /// The first parameter or gain out of range.
    pub fn new(vehicle: &Parameters, gains: PerAxis<Gains>) -> Result<Self, OutOfRange> {
        vehicle.validate()?;
        for axis in Axis::ALL {
            gains[axis].validate()?;
        }
        Ok(Backstepping { gains, model: Model::new(vehicle) })
    }
}

impl Law for Backstepping {
    /// None: a fixed law has no memory.
    type Estimate = ();

    #[inline]
    fn input(&self, axis: Axis, tracking: &Tracking, context: &Context, (): &mut ()) -> (f32, Errors) {
        classical(&self.gains[axis], tracking, &self.model.dynamics(axis, context))
    }

    fn alpha1(&self, axis: Axis) -> f32 {
        self.gains[axis].alpha1
    }

    fn learnt((): &()) -> Estimate {
        Estimate::default()
    }
}

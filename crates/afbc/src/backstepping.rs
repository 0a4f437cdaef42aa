//! Backstepping of one second-order subsystem (7), and the classical controller that the paper compares with.

use crate::law::{Context, Law, Tracking};
use crate::model::{Dynamics, Model};
use afbc_control::{Errors, Estimate};
use afbc_types::{Axis, Declared, OutOfRange, Parameters, PerAxis, parameters};

/// The ideal law u*_eq (16), for known f, g and dg/dt.
#[inline]
pub fn ideal(alpha1: f32, errors: &Errors, x1d_ddot: f32, dynamics: &Dynamics) -> f32 {
    let Errors { e1, e2, .. } = *errors;
    compensated(e1 + alpha1 * (e2 - alpha1 * e1) + x1d_ddot, e2, dynamics)
}

/// The input for an acceleration, with what (16) takes off for f and dg/dt.
#[inline]
fn compensated(acceleration: f32, e2: f32, dynamics: &Dynamics) -> f32 {
    let Dynamics { f, g, g_dot } = *dynamics;
    (acceleration - f - 0.5 * g_dot / g * e2) / g
}

/// u_pd (21).
#[inline]
pub fn proportional(alpha2: f32, errors: &Errors) -> f32 {
    alpha2 * errors.e2
}

/// u*_eq + alpha_2 e_2 with the errors behind it. At the speed limit e_1 stands still, and (16) is for e_2 alone, whose
/// rate is d^2 x_1d/dt^2 - f - g u: otherwise -alpha_1^2 e_1 would hold a vehicle back that comes up to its speed.
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
    /// The two gains of one backstepping subsystem. By default those of Section IV for attitude, x and y.
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
    /// The baseline for a vehicle with these nominal parameters.
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
    /// A fixed law remembers nothing.
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

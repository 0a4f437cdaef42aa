//! Interface of a control law in the [cascade](crate::cascade).

use crate::model::{Dynamics, ModelConstants, RollPitch};
use afbc_control::Errors;
use afbc_types::{Axis, PerAxis, State};
use nalgebra::Vector3;

/// Computes a subsystem's input from its errors. AFBC, its fallback and the baseline differ only in this trait.
pub trait SubsystemLaw {
    /// True if the law uses [`StepContext::rotor_residual_rad_s`].
    const USES_ROTOR_RESIDUAL: bool = true;

    /// True if the law uses [`StepContext::observed_m_s2`].
    const OBSERVES: bool = false;

    /// Memory of the law for one subsystem.
    type Estimate: Copy + Default + core::fmt::Debug + 'static;

    /// Returns u_i in the subsystem's unit (N for roll, pitch, yaw and z; m/s2 for x and y), and the errors. Updates
    /// the estimate if the context allows it.
    fn input(
        &self,
        axis: Axis,
        tracking: &SubsystemTracking,
        context: &StepContext,
        estimate: &mut Self::Estimate,
    ) -> (f32, Errors);

    /// Returns the approach speed per error e_1 \[1/s\] at which the law keeps that speed for a constant error.
    fn approach(&self, axis: Axis, known: Option<&ModelConstants>) -> f32;

    /// Initialises the estimates for a start in flight with this weight.
    fn start(&self, _estimates: &mut PerAxis<Self::Estimate>, _weight_n: f32) {}

    /// Returns the hover thrust U4 \[N\] from the estimate of z, or the weight for a law without an estimate.
    fn hover_thrust_n(&self, _z: &Self::Estimate, weight_n: f32, _known_n: f32) -> f32 {
        weight_n
    }
}

/// Data shared by all six subsystems in one step.
#[derive(Clone, Copy, Debug)]
pub struct StepContext<'a> {
    /// State used in the step.
    pub state: &'a State,
    /// Sines and cosines of roll and pitch in `state`.
    pub roll_pitch: RollPitch,
    /// omega of (6) as last commanded \[rad/s\].
    pub rotor_residual_rad_s: f32,
    /// Time step \[s\].
    pub dt_s: f32,
    /// False if the estimates of roll, pitch, yaw, x and y must not change.
    pub adapt: bool,
    /// False if the estimate of z must not change.
    pub adapt_z: bool,
    /// Part of each subsystem's input that the last step could not allocate; zero without anti-windup.
    pub unallocated: &'a PerAxis<f32>,
    /// f of x, y and z \[m/s2\]: drag, plus the observed part ([`crate::disturbance`]). Zero without an observer.
    pub observed_m_s2: Vector3<f32>,
    /// Factor on the speed of z, below 1 for old states.
    pub softness: f32,
    /// Nominal model for feed-forward, `None` for the law as printed.
    pub known: Option<&'a ModelConstants>,
}

impl StepContext<'_> {
    /// Returns f, g and dg/dt of a subsystem from `model` in this step.
    #[inline]
    pub(crate) fn dynamics(&self, model: &ModelConstants, axis: Axis) -> Dynamics {
        model.dynamics_at(axis, &self.state.rates_rad_s, &self.roll_pitch, self.rotor_residual_rad_s)
    }

    /// Returns true if the subsystem's estimate may change.
    #[inline(always)]
    pub(crate) fn adapts(&self, axis: Axis) -> bool {
        if matches!(axis, Axis::Z) { self.adapt_z } else { self.adapt }
    }

    /// Returns the factor on the speed of a subsystem, and its tracking with the approach speed of that factor.
    #[inline(always)]
    pub(crate) fn softened(&self, axis: Axis, tracking: &SubsystemTracking) -> (f32, SubsystemTracking) {
        let softness = if matches!(axis, Axis::Z) { self.softness } else { 1.0 };
        let approach_1_s = tracking.approach_1_s.map(|approach_1_s| approach_1_s * softness);
        (softness, SubsystemTracking { approach_1_s, ..*tracking })
    }

    /// Returns f, g and dg/dt with the observed f of x, y and z. The observed moments of roll, pitch and yaw are
    /// compensated after the law.
    #[inline(always)]
    pub(crate) fn observed(&self, model: &ModelConstants, axis: Axis) -> Dynamics {
        let dynamics = self.dynamics(model, axis);
        let [x, y, z] = self.observed_m_s2.into();
        match axis {
            Axis::X => Dynamics { f: x, ..dynamics },
            Axis::Y => Dynamics { f: y, ..dynamics },
            Axis::Roll | Axis::Pitch | Axis::Yaw => dynamics,
            // The model's f of z is gravity, which stays. Its f of x and y is zero.
            Axis::Z => Dynamics { f: dynamics.f + z, ..dynamics },
        }
    }
}

/// State and reference of a subsystem: x_1, x_2 and the reference with two derivatives, in m or rad, and seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SubsystemTracking {
    /// x_1
    pub x1: f32,
    /// x_2 = d x_1/dt
    pub x2: f32,
    /// e_1 = x_1d - x_1 (9), for yaw wrapped to +-pi.
    pub e1: f32,
    /// d x_1d/dt
    pub x1d_dot: f32,
    /// d^2 x_1d/dt^2
    pub x1d_ddot: f32,
    /// Approach speed per e_1 \[1/s\] if the speed limit has cut e_1; otherwise `None`.
    pub approach_1_s: Option<f32>,
}

impl SubsystemTracking {
    /// Returns (9) and (12): e_2 = d x_1d/dt + alpha_1 e_1 - x_2. At the speed limit, the approach speed per error
    /// replaces alpha_1, so that e_2 and the adaptation are zero at that speed.
    #[inline]
    pub fn errors(&self, alpha1: f32) -> Errors {
        let SubsystemTracking { e1, x1d_dot, x2, approach_1_s, .. } = *self;
        let e1_dot = x1d_dot - x2;
        Errors { e1, e1_dot, e2: e1_dot + approach_1_s.unwrap_or(alpha1) * e1 }
    }
}

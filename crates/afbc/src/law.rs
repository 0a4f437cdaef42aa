//! A control law in the [cascade](crate::cascade): what it is given of one subsystem, and what it gives.

use afbc_control::{Errors, Estimate};
use afbc_types::{Axis, PerAxis, State};

/// How one subsystem turns its errors into its input. AFBC and the baseline differ in nothing else.
pub trait Law {
    /// What the law remembers of one subsystem from step to step.
    type Estimate: Copy + Default + core::fmt::Debug;

    /// u_i in the subsystem's own unit (N for roll, pitch, yaw and z; m/s2 for x and y), with the errors behind it.
    /// May update the estimate, if the context lets it.
    fn input(&self, axis: Axis, tracking: &Tracking, context: &Context, estimate: &mut Self::Estimate)
    -> (f32, Errors);

    /// alpha_1 of the subsystem \[1/s\].
    fn alpha1(&self, axis: Axis) -> f32;

    /// Turns estimates that know nothing yet into those to start from in flight, for a vehicle of this weight.
    fn start(&self, _estimates: &mut PerAxis<Self::Estimate>, _weight_n: f32) {}

    /// U4 that it takes to hover \[N\], by the estimate of the z subsystem; for a law that does not know, the weight.
    fn hover_thrust_n(&self, _z: &Self::Estimate, weight_n: f32) -> f32 {
        weight_n
    }

    /// What `estimate` holds in AFBC's terms, for logs and monitors; zero for a law that learns nothing.
    fn learnt(estimate: &Self::Estimate) -> Estimate;
}

/// What all six subsystems share in one step.
#[derive(Clone, Copy, Debug)]
pub struct Context<'a> {
    /// The state that the step works from.
    pub state: &'a State,
    /// omega of (6), as last commanded \[rad/s\].
    pub rotor_residual_rad_s: f32,
    /// Time step \[s\].
    pub dt_s: f32,
    /// False if estimates must stay as they are.
    pub adapt: bool,
    /// What each subsystem wanted of its input in the last step and could not have; zero if it is not to care.
    pub unallocated: PerAxis<f32>,
}

/// What a subsystem is and what it should be: x_1, x_2 and the reference with two derivatives. In m or rad, and seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tracking {
    /// x_1
    pub x1: f32,
    /// x_2 = d x_1/dt
    pub x2: f32,
    /// e_1 = x_1d - x_1 (9), for yaw the short way round.
    pub e1: f32,
    /// d x_1d/dt
    pub x1d_dot: f32,
    /// d^2 x_1d/dt^2
    pub x1d_ddot: f32,
    /// True if e_1 is less than the distance, since that would ask for more speed than is allowed.
    pub limited: bool,
}

impl Tracking {
    /// (9), (12): e_2 = d x_1d/dt + alpha_1 e_1 - x_2.
    #[inline]
    pub fn errors(&self, alpha1: f32) -> Errors {
        let Tracking { e1, x1d_dot, x2, .. } = *self;
        let e1_dot = x1d_dot - x2;
        Errors { e1, e1_dot, e2: e1_dot + alpha1 * e1 }
    }
}

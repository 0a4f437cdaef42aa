//! Linear model-predictive control of the position, by ADMM with a cached Riccati solution.
//!
//! The controller is that of Kamel, Stastny, Alexis, Siegwart, *Model predictive control for trajectory tracking of
//! unmanned aerial vehicles using Robot Operating System*, in Robot Operating System (ROS), Springer 2017: a linear
//! model with the attitude loop as a lag, an observed disturbance, and bounds on tilt and thrust. The solver is
//! TinyMPC's (Nguyen, Schoedel, Alavilli, Plancher, Manchester, *TinyMPC: model-predictive control on
//! resource-constrained microcontrollers*, ICRA 2024). The attitude loop is that of [`dfbc`](crate::dfbc). Along each
//! axis, x = \[p - p_d, v - v_d, a - a_d\] with the model's acceleration a, u is the commanded acceleration minus a_d,
//! and there are N steps of length h:
//! ```text
//! model        d(a - a_d)/dt = (u - (a - a_d)) / tau, held over h:   x+ = A x + B u
//! cost         sum over N of q_p x_1^2 + q_v x_2^2 + u^2, and the cost to go of the last x
//! bounds       a_d + u - d + g e_z within Limits
//! disturbance  d = (dv/dt)_f - (U4/m R e_z + drag)_f + g e_z + drag, with known drag
//! ADMM         p_k = (A - B K)' p_k+1 - K' r_k,   r_k = -rho (z_k - y_k)
//!              e_k = (B' p_k+1 + r_k) / (1 + rho + B' P B)
//!              u_k = -K x_k - e_k,   x_k+1 = A x_k + B u_k
//!              z_k = u_k + y_k within the bounds,   y_k += u_k - z_k
//! ```
//!
//! where P and K solve the Riccati equation for the input weight 1 + rho. The first u is flown.
//!
//! # Decisions
//!
//! * **Unbounded optimum**: u = -K x with input weight 1 is the solution, and is flown, if no planned step reaches a
//!   bound. Otherwise [`ITERATIONS`] iterations per step continue from the last step's.
//! * **Bounds** use the present reference, because the future one is unknown. Height comes before sideways acceleration
//!   ([`SpecificForceLimits::apply`]), which couples the axes.
//! * **Lag** applies to the feedback only: the reference's own turning is fed forward, as in [`crate::dfbc`]. a comes
//!   from the model: fed back as measured, it causes a fall with weak rotors and a large inertia.
//! * **Drag** stated in the vehicle file is used as in [`crate::dfbc`]; other disturbances are observed.
//! * **Rotor knowledge**: the time constant [`Gains::rotor_time_constant_s`], like INDI.

use crate::attitude::{r_earth_body, unit};
use crate::body::{Demand, NominalVehicle};
use crate::differentiator::{Differentiator, DifferentiatorMemory};
use crate::flat_attitude::{AttitudeDemand, AttitudeGains, FlatAttitude, dragged};
use crate::increment::IncrementMemory;
use crate::limits::SpecificForceLimits;
use crate::loops::xy_and_z;
use crate::rotor_model::{RotorModel, RotorModelMemory};
use afbc_control::drag::KnownDrag;
use afbc_control::{Action, FlightController, Mixer, Settings, Smoothed, Smoothing, Trace, math};
use afbc_types::{Airframe, Declared, OutOfRange, Setpoint, State, parameters};
use nalgebra::{Matrix3, Vector3};

/// Number N of planned steps.
pub const HORIZON: usize = 12;
/// Number of ADMM iterations per step when a bound is reached.
pub const ITERATIONS: usize = 4;
/// Weight of ADMM's penalty, relative to the weight of u.
const RHO: f32 = 1.0;
/// Iterations of the Riccati equation in the constructor, enough to converge.
const RICCATI: usize = 400;

parameters! {
    /// Gains and limits. Defaults are the result of `sitl tune` for the paper's vehicle with a rotor lag of 20 ms
    /// (`docs/tuning.md`).
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct Gains {
        /// q_p along x and y.
        #[parameter(POS_Q, "1/s4", 0.1..=10000.0, tuned)]
        pub position_weight_1_s4: f32 = 1184.0,
        /// q_v along x and y.
        #[parameter(VEL_Q, "1/s2", 0.0..=1000.0, tuned)]
        pub velocity_weight_1_s2: f32 = 7.464,
        /// q_p along z.
        #[parameter(HEIGHT_Q, "1/s4", 0.1..=10000.0, tuned)]
        pub height_weight_1_s4: f32 = 2568.0,
        /// q_v along z.
        #[parameter(CLIMB_Q, "1/s2", 0.0..=1000.0, tuned)]
        pub climb_weight_1_s2: f32 = 33.05,
        /// tau of x and y: lag of the attitude.
        #[parameter(TILT_LAG, "s", 0.005..=1.0, tuned)]
        pub tilt_lag_s: f32 = 0.05311,
        /// tau of z: lag of the thrust.
        #[parameter(LIFT_LAG, "s", 0.005..=1.0, tuned)]
        pub lift_lag_s: f32 = 0.04235,
        /// h: length of a planned step.
        #[parameter(PLAN_STEP, "s", 0.005..=0.5)]
        pub plan_step_s: f32 = 0.03,
        /// w: bandwidth of the filter on velocity and thrust, behind which the disturbance is observed.
        #[parameter(POS_FILTER, "rad/s", 5.0..=300.0, tuned)]
        pub position_filter_rad_s: f32 = 80.95,
        /// k_R of roll and pitch: gain on the attitude error.
        #[parameter(TILT_P, "1/s2", 10.0..=1000.0, tuned)]
        pub tilt_p_1_s2: f32 = 293.3,
        /// k_Omega of roll and pitch: gain on the error of the angular rate.
        #[parameter(TILT_D, "1/s", 2.0..=100.0, tuned)]
        pub tilt_d_1_s: f32 = 22.21,
        /// k_R of yaw: gain on the yaw error.
        #[parameter(YAW_P, "1/s2", 0.5..=200.0, tuned)]
        pub yaw_p_1_s2: f32 = 84.19,
        /// k_Omega of yaw: gain on the error of the yaw rate.
        #[parameter(YAW_D, "1/s", 0.5..=40.0, tuned)]
        pub yaw_d_1_s: f32 = 13.11,
        /// w: bandwidth of the filter on rates and U1..U3.
        #[parameter(ATT_FILTER, "rad/s", 10.0..=500.0, tuned)]
        pub attitude_filter_rad_s: f32 = 84.82,
        /// tau: time constant of the rotor model.
        #[parameter(ROT_LAG, "s", 0.0..=0.5)]
        pub rotor_time_constant_s: f32 = 0.02,
        /// Largest tilt.
        #[parameter(TILT_MAX, "rad", 0.05..=1.2)]
        pub tilt_max_rad: f32 = 1.0,
        /// Filters on U1..U4.
        #[group("")]
        pub smoothing: Smoothing = Smoothing {
            smooth_tilt_rad_s: 136.8,
            smooth_yaw_rad_s: 117.6,
            smooth_lift_rad_s: 81.35,
            lead_s: 0.0252,
        },
    }
}

impl Gains {
    /// Gains tuned by `sitl tune` for the paper's vehicle with a rotor lag of 20 ms (`docs/tuning.md`).
    pub const TUNED: Self = Self::DEFAULT;

    /// Gains tuned by hand for the paper's vehicle with a rotor lag of 20 ms.
    pub const PAPER_VEHICLE: Self = Gains {
        position_weight_1_s4: 80.0,
        velocity_weight_1_s2: 10.0,
        height_weight_1_s4: 400.0,
        climb_weight_1_s2: 20.0,
        tilt_lag_s: 0.1,
        lift_lag_s: 0.03,
        plan_step_s: 0.03,
        position_filter_rad_s: 8.0,
        tilt_p_1_s2: 200.0,
        tilt_d_1_s: 22.0,
        yaw_p_1_s2: 16.0,
        yaw_d_1_s: 6.0,
        attitude_filter_rad_s: 80.0,
        rotor_time_constant_s: 0.02,
        tilt_max_rad: 1.0,
        smoothing: Smoothing::DEFAULT,
    };
}

/// Cached solution of the Riccati equation for one axis and one input weight.
#[derive(Clone, Copy, Debug, PartialEq)]
struct RiccatiSolution {
    /// K
    gain: Vector3<f32>,
    /// (A - B K)'
    closed: Matrix3<f32>,
    /// 1 / (weight + B' P B)
    inverse: f32,
}

/// Planner of one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
struct AxisPlanner {
    a: Matrix3<f32>,
    b: Vector3<f32>,
    unbounded: RiccatiSolution,
    penalised: RiccatiSolution,
}

impl AxisPlanner {
    /// Creates the planner for weights of position and velocity, lag `tau` and step `h`.
    fn new(weights: [f32; 2], tau: f32, h: f32) -> Self {
        let kept = math::exp(-h / tau);
        // Integrals of the decaying acceleration and of u over the step.
        let (once, late) = (tau * (1.0 - kept), h - tau * (1.0 - kept));
        let a = Matrix3::new(1.0, h, tau * late, 0.0, 1.0, once, 0.0, 0.0, kept);
        let b = Vector3::new(0.5 * h * h - tau * late, late, 1.0 - kept);
        let [position, velocity] = weights;
        let q = Vector3::new(position, velocity, 0.0);
        let solution = |weight| RiccatiSolution::new(&a, &b, &q, weight);
        AxisPlanner { a, b, unbounded: solution(1.0), penalised: solution(1.0 + RHO) }
    }
}

impl RiccatiSolution {
    /// Solves the Riccati equation by value iteration.
    fn new(a: &Matrix3<f32>, b: &Vector3<f32>, q: &Vector3<f32>, weight: f32) -> Self {
        let q = Matrix3::from_diagonal(q);
        let step = |p: &Matrix3<f32>| {
            // The weight is at least 1 and P is not negative, so the divisor is positive.
            let inverse = 1.0 / (weight + b.dot(&(p * b)));
            let gain: Vector3<f32> = (a.tr_mul(p) * b) * inverse;
            (gain, inverse, a - b * gain.transpose())
        };
        let mut p = q;
        for _ in 0..RICCATI {
            let (_, _, closed) = step(&p);
            let next = q + a.tr_mul(&(p * closed));
            // The matrix is made symmetric again, so that rounding errors do not build up over the iterations.
            p = (next + next.transpose()) * 0.5;
        }
        let (gain, inverse, closed) = step(&p);
        RiccatiSolution { gain, closed: closed.transpose(), inverse }
    }
}

/// MPC controller with its constants. Everything that changes in flight is in [`Memory`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mpc<const N: usize = 4> {
    body: NominalVehicle<N>,
    dt_s: f32,
    weight_n: f32,
    drag: KnownDrag,
    limits: SpecificForceLimits,
    position_filter: Differentiator,
    rotors: RotorModel<N>,
    /// Planner of x and y, and planner of z.
    axes: [AxisPlanner; 2],
    /// 1 - exp(-dt / tau)
    follows: Vector3<f32>,
    attitude: FlatAttitude,
}

/// Vectors x, or p of ADMM, one per axis.
type AxisErrors = [Vector3<f32>; 3];

/// Variables z and y of ADMM.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct AdmmVariables {
    z: Vector3<f32>,
    y: Vector3<f32>,
}

/// State of the controller between steps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Memory<const N: usize = 4> {
    rotors: RotorModelMemory<N>,
    velocity: DifferentiatorMemory,
    specific_force: DifferentiatorMemory,
    reaction: IncrementMemory,
    plan: [AdmmVariables; HORIZON],
    /// a - a_d by the model \[m/s2\].
    lagging: Vector3<f32>,
    smoothed: Option<Smoothed>,
    /// Trace of the last step.
    trace: Trace,
}

impl<const N: usize> Mpc<N> {
    /// Creates a controller for a vehicle with these nominal parameters.
    ///
    /// # Errors
    /// Returns the first parameter, setting or gain that is out of range.
    pub fn new(vehicle: impl Into<Airframe<N>>, settings: Settings, gains: Gains) -> Result<Self, OutOfRange> {
        let vehicle = vehicle.into();
        let body = NominalVehicle::new(&vehicle, &settings, &gains.smoothing)?;
        let (vehicle, thrust_max_n) = (vehicle.parameters, body.mixer.thrust_max_n());
        gains.validate()?;
        let weights = [gains.position_weight_1_s4, gains.velocity_weight_1_s2];
        let upright = [gains.height_weight_1_s4, gains.climb_weight_1_s2];
        let inner = AttitudeGains {
            tilt: [gains.tilt_p_1_s2, gains.tilt_d_1_s],
            yaw: [gains.yaw_p_1_s2, gains.yaw_d_1_s],
            filter_rad_s: gains.attitude_filter_rad_s,
        };
        Ok(Mpc {
            body,
            dt_s: settings.dt_s,
            weight_n: vehicle.weight_n(),
            drag: settings.drag,
            limits: SpecificForceLimits::new(&vehicle, thrust_max_n, gains.tilt_max_rad),
            position_filter: Differentiator::new(gains.position_filter_rad_s, settings.dt_s)?,
            rotors: RotorModel::new(&body, vehicle.weight_n(), gains.rotor_time_constant_s, settings.dt_s),
            axes: [
                AxisPlanner::new(weights, gains.tilt_lag_s, gains.plan_step_s),
                AxisPlanner::new(upright, gains.lift_lag_s, gains.plan_step_s),
            ],
            follows: xy_and_z(gains.tilt_lag_s, gains.lift_lag_s).map(|tau| 1.0 - math::exp(-settings.dt_s / tau)),
            attitude: FlatAttitude::new(&inner, settings.dt_s)?,
        })
    }

    /// Returns the first u of the plan from the errors `x` of each axis. `allowed` limits each u to the bounds.
    #[inline]
    fn planned(
        &self,
        plan: &mut [AdmmVariables; HORIZON],
        x: &AxisErrors,
        allowed: impl Fn(&Vector3<f32>) -> Vector3<f32>,
    ) -> Vector3<f32> {
        // Flies the unbounded optimum if it is within all bounds.
        let (mut ahead, mut free) = (*x, true);
        let first = self.fed_back(x, |axis| &axis.unbounded);
        for split in plan.iter_mut() {
            let u = self.fed_back(&ahead, |axis| &axis.unbounded);
            free &= allowed(&u) == u;
            if !free {
                break;
            }
            // ADMM starts from these values when a bound is reached.
            *split = AdmmVariables { z: u, y: Vector3::zeros() };
            self.roll_out(&mut ahead, &u);
        }
        if free {
            return first;
        }

        let mut flown = first;
        // Continues from the last plan without shifting it: a planned step is much longer than a control step.
        for _ in 0..ITERATIONS {
            let mut forced = [Vector3::zeros(); HORIZON];
            let mut p = AxisErrors::default();
            for (split, forced) in plan.iter().zip(&mut forced).rev() {
                *forced = self.pulled_back(&mut p, &((split.y - split.z) * RHO));
            }
            let mut ahead = *x;
            for (split, forced) in plan.iter_mut().zip(&forced) {
                let u = self.fed_back(&ahead, |axis| &axis.penalised) - forced;
                split.z = allowed(&(u + split.y));
                split.y += u - split.z;
                self.roll_out(&mut ahead, &u);
            }
            // z and not u: before both converge, only z is within the bounds.
            flown = plan.first().map_or(first, |split| split.z);
        }
        flown
    }

    fn axes(&self) -> [&AxisPlanner; 3] {
        let [xy, z] = &self.axes;
        [xy, xy, z]
    }

    /// Returns -K x.
    #[inline]
    fn fed_back(&self, x: &AxisErrors, pick: fn(&AxisPlanner) -> &RiccatiSolution) -> Vector3<f32> {
        let ([x, y, z], [of_x, of_y, of_z]) = (x, self.axes());
        let of = |axis, x: &Vector3<f32>| -pick(axis).gain.dot(x);
        Vector3::new(of(of_x, x), of(of_y, y), of(of_z, z))
    }

    /// Advances x by one planned step with input u.
    #[inline]
    fn roll_out(&self, x: &mut AxisErrors, u: &Vector3<f32>) {
        for ((axis, x), u) in self.axes().into_iter().zip(x).zip(u.iter()) {
            *x = axis.a * *x + axis.b * *u;
        }
    }

    /// Propagates p back by one planned step with r, and returns e.
    #[inline]
    fn pulled_back(&self, p: &mut AxisErrors, r: &Vector3<f32>) -> Vector3<f32> {
        let mut forced = Vector3::zeros();
        for (((axis, p), r), forced) in self.axes().into_iter().zip(p).zip(r.iter()).zip(forced.iter_mut()) {
            let RiccatiSolution { gain, closed, inverse } = &axis.penalised;
            *forced = (axis.b.dot(p) + r) * *inverse;
            *p = closed * *p - gain * *r;
        }
        forced
    }
}

impl<const N: usize> FlightController<N> for Mpc<N> {
    type Memory = Memory<N>;

    fn dt_s(&self) -> f32 {
        self.dt_s
    }

    fn mixer(&self) -> &Mixer<N> {
        &self.body.mixer
    }

    fn trace(memory: &Memory<N>) -> Trace {
        memory.trace
    }

    #[inline]
    fn decide(&self, memory: &mut Memory<N>, state: &State, setpoint: &Setpoint, fresh: bool) -> Action<N> {
        let r = r_earth_body(&state.attitude_rad);
        let up = unit(&r.column(2).into());
        let now = self.rotors.inputs(&self.body, &memory.rotors);
        let thrust_m_s2 = up * (now.thrust_n / self.body.mass_kg);
        let drag = self.drag.acceleration(&state.velocity_m_s, &up, now.thrust_n / self.weight_n);
        if fresh {
            self.position_filter.advance(&mut memory.specific_force, &(thrust_m_s2 + drag));
            self.position_filter.advance(&mut memory.velocity, &state.velocity_m_s);
            self.attitude.measure(&mut memory.reaction, &self.body.angular_acceleration(&now), &state.rates_rad_s);
        }

        // Position.
        let disturbance = memory.velocity.derivative() - memory.specific_force.value() + drag + self.limits.gravity();
        let (position_error_m, velocity_error_m_s) =
            (setpoint.position_m - state.position_m, setpoint.velocity_m_s - state.velocity_m_s);
        let (p, v, a) = (-position_error_m, -velocity_error_m_s, memory.lagging);
        let x = [Vector3::new(p.x, v.x, a.x), Vector3::new(p.y, v.y, a.y), Vector3::new(p.z, v.z, a.z)];
        let balance = setpoint.acceleration_m_s2 - disturbance + self.limits.gravity();
        let u = self.planned(&mut memory.plan, &x, |u| {
            let wanted = balance + u;
            let given = self.limits.apply(&wanted);
            // A u within the bounds stays exactly the same.
            if (given - wanted).abs().max() <= 1e-4 { *u } else { given - balance }
        });
        let specific_force = self.limits.apply(&(balance + u));
        // Uses u after the bounds: the model must not run ahead of the command.
        memory.lagging = (a + (specific_force - balance - a).component_mul(&self.follows)).map(math::settled);

        // Attitude.
        let thrust_m_s2 = specific_force.dot(&up);
        let thrust = [thrust_m_s2 / self.limits.gravity().z, thrust_m_s2];
        let flying = self.limits.apply(&(setpoint.acceleration_m_s2 - disturbance + self.limits.gravity()));
        let AttitudeDemand { desired, rates_rad_s, angular_acceleration_rad_s2, attitude_error, rate_error } =
            self.attitude.output(
                &memory.reaction,
                &r,
                state,
                [&specific_force, &flying],
                &dragged(&self.drag, setpoint, &up, thrust),
            );
        let demand = Demand {
            thrust_n: self.body.mass_kg * specific_force.dot(&up).max(0.0),
            angular_acceleration_rad_s2,
            acceleration_m_s2: setpoint.acceleration_m_s2 + u,
            desired,
            desired_rates_rad_s: rates_rad_s,
            errors: [position_error_m, velocity_error_m_s, attitude_error, rate_error],
        };
        let (action, trace, _) = self.body.act(&demand, &mut memory.smoothed);
        memory.trace = trace;
        self.rotors.advance(&mut memory.rotors, &action.speeds);
        action
    }
}

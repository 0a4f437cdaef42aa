//! Six subsystems in one cascade: position gives thrust and desired attitude, attitude gives U1..U3, and all give rotor
//! speeds. Section III-D, Fig. 2.

use crate::disturbance::{ForceObserver, ForceObserverMemory, MomentObserver, Turning};
use crate::forward::{Followed, Forward};
use crate::law::{Context, Law, Tracking};
use crate::limits::Limits;
use crate::model::{ModelConstants, RollPitch, euler_rates};
use crate::reference::{Detours, ReferenceFilter};
use crate::rotation::Turn;
pub use crate::settings::Settings;
use crate::standstill::Standstill;
use crate::tilt::Tilt;
use afbc_control::command_filter::{CommandFilter, Filtered};
use afbc_control::mixer::{Allocation, Mixer};
use afbc_control::{Action, Errors, FlightController, Smoothed, Smoother, Trace, math};
use afbc_types::{Airframe, Axis, Declared, Inputs, OutOfRange, Parameters, PerAxis, Setpoint, State};
use nalgebra::Vector3;

/// Smallest vertical thrust over weight that the tilt is computed with, since a sinking vehicle must not tilt further.
/// Not in the paper.
pub const VERTICAL_MIN: f32 = 0.3;

/// Smallest and largest factor of U1..U3 for rotors that are weaker or stronger than the model's, as far as the learnt
/// hover thrust over the weight shows: a heavier vehicle, which may be no harder to turn, takes more thrust as well.
/// Not in the paper.
pub const EFFORT_MIN: f32 = 0.7;
/// See [`EFFORT_MIN`].
pub const EFFORT_MAX: f32 = 1.8;
/// Bandwidth with which the factor follows the learnt hover thrust \[rad/s\]: no hand-over between laws makes it jump.
const EFFORT_RAD_S: f32 = 5.0;

/// A controller. Constant; everything that changes in flight is in [`Cascade`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Controller<L, const N: usize = 4> {
    law: L,
    /// Nominal model for the feed-forward.
    model: ModelConstants,
    observer: Option<ForceObserver>,
    moments: Option<MomentObserver>,
    reference: Option<ReferenceFilter>,
    smoother: Smoother,
    mixer: Mixer<N>,
    filter: CommandFilter,
    forward: Forward,
    settings: Settings,
    weight_n: f32,
    inverse_weight: f32,
    /// Share of the effort that is replaced per step.
    effort_share: f32,
    gravity_m_s2: f32,
    inverse_gravity: f32,
    /// Lag 1/w of the command filter \[s\].
    command_lag_s: f32,
    tilt_max_tan: f32,
    /// Largest thrust of all rotors together \[N\].
    thrust_max_n: f32,
    /// Of x, y and z: largest e_1 \[m\], and the speed of approach per e_1 \[1/s\], which make the speed limit.
    approach: [(f32, f32); 3],
}

/// Desired roll and pitch in one step.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Desired {
    /// phi_d, theta_d of (40) \[rad\].
    rad: [f32; 2],
    /// The angles for the command filter: the same, ahead by its lag.
    commanded: [f32; 2],
    /// Filtered previous angles, which roll and pitch track.
    filtered: [Filtered; 2],
}

/// Memory of the cascade.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cascade<E> {
    /// Estimates of each subsystem.
    pub estimates: PerAxis<E>,
    /// Errors of each subsystem in the last step.
    pub errors: PerAxis<Errors>,
    /// Distance of each subsystem from its reference in the last step, e_1 without the speed limit \[m or rad\].
    pub distances: PerAxis<f32>,
    /// Inputs of each subsystem in the last step: U1..U4 \[N\], u5, u6 \[m/s2\].
    pub inputs: PerAxis<f32>,
    /// U1..U4 asked of the mixer in the last step, behind the filters.
    pub asked: Inputs,
    /// Desired roll and pitch in the last step; none before the first.
    desired: Option<Desired>,
    /// See [`Forward`]; none before the first step.
    followed: Option<Followed>,
    /// See [`Context::unallocated`].
    unallocated: PerAxis<f32>,
    standstill: Standstill,
    rotor_residual_rad_s: f32,
    /// eta and d eta/dt in the last step: the body's rates as in (6), or with feed-forward what follows from them.
    pub(crate) turning: [Vector3<f32>; 2],
    /// See [`ForceObserver`]; none before the first step.
    pub(crate) observed: Option<ForceObserverMemory>,
    /// See [`MomentObserver`]; none before the first step.
    turned: Option<Turning>,
    /// Factor of U1..U3 for weak rotors, less one: see [`EFFORT_MIN`].
    more_effort: f32,
    /// See [`ReferenceFilter`]; none before the first step.
    detours: Option<Detours>,
    /// See [`Smoother`].
    smoothed: Option<Smoothed>,
}

impl<E> Cascade<E> {
    /// Returns the memory with the estimates of another law, which starts with this rotor residual.
    pub(crate) fn handed_over<F>(&self, estimates: PerAxis<F>, rotor_residual_rad_s: f32) -> Cascade<F> {
        let Cascade { errors, distances, inputs, asked, desired, followed, unallocated, standstill, .. } = *self;
        let Cascade { turning, observed, turned, more_effort, detours, smoothed, .. } = *self;
        Cascade {
            estimates,
            errors,
            distances,
            inputs,
            asked,
            desired,
            followed,
            unallocated,
            standstill,
            rotor_residual_rad_s,
            turning,
            observed,
            turned,
            more_effort,
            detours,
            smoothed,
        }
    }

    /// Returns the trace of the last step.
    pub(crate) fn trace(&self) -> Trace {
        let PerAxis { x, y, .. } = self.inputs;
        let (rad, filtered) =
            self.desired.map_or(([0.0; 2], Default::default()), |Desired { rad, filtered, .. }| (rad, filtered));
        let mut trace = Trace::default();
        trace.inputs = self.asked;
        trace.virtual_m_s2 = [x, y];
        (trace.desired_rad, trace.filtered) = (rad, filtered);
        trace.errors = self.errors;
        trace
    }
}

/// Returns desired roll and pitch (40) \[rad\] for the horizontal accelerations u5, u6 \[m/s2\] at yaw psi \[rad\].
/// `inverse_vertical` is mass over vertical thrust: 1/g in hover, as in (39).
pub fn desired_attitude(u5: f32, u6: f32, yaw_rad: f32, inverse_vertical: f32) -> [f32; 2] {
    Tilt::new(u5, u6, [math::sin(yaw_rad), math::cos(yaw_rad)], inverse_vertical).rad
}

/// Returns a vector reduced to a norm of `max` in the same direction.
#[inline]
fn within([x, y]: [f32; 2], max: f32) -> [f32; 2] {
    let square = x * x + y * y;
    let scale = if square > max * max { max / math::sqrt(square) } else { 1.0 };
    [x * scale, y * scale]
}

impl<L: Law, const N: usize> Controller<L, N> {
    /// Creates a controller for a vehicle with these nominal parameters.
    ///
    /// # Errors
    /// The first parameter or setting out of range.
    pub fn new(vehicle: impl Into<Airframe<N>>, settings: Settings, law: L) -> Result<Self, OutOfRange> {
        settings.validate()?;
        let vehicle = vehicle.into();
        let mixer = settings.common.mixer(vehicle)?;
        let Parameters { gravity_m_s2, .. } = vehicle.parameters;
        let Limits { speed_max_m_s, climb_max_m_s, .. } = settings.limits;
        let model = ModelConstants::new(&vehicle.parameters);
        let known = settings.feed_forward.then_some(&model);
        let approach = |axis, speed| {
            let approach_1_s = law.approach(axis, known);
            (speed / approach_1_s, approach_1_s)
        };
        Ok(Controller {
            approach: [
                approach(Axis::X, speed_max_m_s),
                approach(Axis::Y, speed_max_m_s),
                approach(Axis::Z, climb_max_m_s),
            ],
            law,
            model,
            // Without feed-forward, or in a law that does not use them, the observers would have no effect.
            observer: (settings.feed_forward && L::OBSERVES)
                .then(|| ForceObserver::new(&settings.disturbance, &settings.common, &vehicle.parameters))
                .transpose()?
                .flatten(),
            moments: (settings.feed_forward && L::OBSERVES)
                .then(|| {
                    let (dt_s, thrust_max_n) = (settings.common.dt_s, mixer.thrust_max_n());
                    MomentObserver::new(&settings.disturbance, &vehicle.parameters, thrust_max_n, dt_s)
                })
                .flatten(),
            reference: ReferenceFilter::new(&settings.reference, &settings.limits, settings.common.dt_s),
            smoother: Smoother::new(&settings.smoothing, settings.common.dt_s)?,
            forward: Forward::new(settings.forward_rad_s, settings.common.dt_s)?,
            filter: CommandFilter::new(settings.command_filter_rad_s, settings.common.dt_s)?
                .limited(settings.limits.tilt_rate_max_rad_s)?,
            settings,
            weight_n: vehicle.parameters.weight_n(),
            inverse_weight: 1.0 / vehicle.parameters.weight_n(),
            effort_share: 1.0 - math::exp(-EFFORT_RAD_S * settings.common.dt_s),
            gravity_m_s2,
            inverse_gravity: 1.0 / gravity_m_s2,
            command_lag_s: 1.0 / settings.command_filter_rad_s,
            tilt_max_tan: math::tan(settings.limits.tilt_max_rad),
            thrust_max_n: mixer.thrust_max_n(),
            mixer,
        })
    }

    /// Returns (u5, u6), reduced to the limits of tilt and acceleration in the same direction.
    #[inline]
    fn limited(&self, u5: f32, u6: f32, vertical: f32) -> [f32; 2] {
        within([u5, u6], math::min(vertical * self.tilt_max_tan, self.settings.limits.acceleration_max_m_s2))
    }

    /// True if the law is given the known part of its input.
    pub(crate) fn feeds_forward(&self) -> bool {
        self.settings.feed_forward
    }

    /// Returns the law in the cascade.
    pub(crate) fn law(&self) -> &L {
        &self.law
    }

    /// Returns the estimated hover thrust U4 \[N\], limited to what the rotors can give.
    pub(crate) fn hover_thrust_n(&self, memory: &Cascade<L::Estimate>) -> f32 {
        let hover_n = self.law.hover_thrust_n(&memory.estimates.z, self.weight_n, self.known_weight_n());
        math::min(hover_n, self.thrust_max_n)
    }

    /// Returns the weight \[N\] as far as the law need not learn it.
    fn known_weight_n(&self) -> f32 {
        if self.settings.feed_forward { self.weight_n } else { 0.0 }
    }

    /// True if the vehicle stands on the ground and `freeze_on_ground` is set.
    #[inline]
    pub(crate) fn stands(&self, memory: &Cascade<L::Estimate>) -> bool {
        self.settings.freeze_on_ground && memory.standstill.stands()
    }

    /// Computes the input of one subsystem, and its errors.
    // Always, so that all subsystems share what they compute.
    #[inline(always)]
    fn input(
        &self,
        axis: Axis,
        tracking: Tracking,
        context: &Context,
        estimate: &mut L::Estimate,
        errors: &mut Errors,
    ) -> f32 {
        let (u, e) = self.law.input(axis, &tracking, context, estimate);
        *errors = e;
        u
    }

    /// Computes (7)-(40) in their order; `fresh` as in [`FlightController::decide`].
    #[inline(never)]
    pub(crate) fn cascade(
        &self,
        memory: &mut Cascade<L::Estimate>,
        state: &State,
        setpoint: &Setpoint,
        fresh: bool,
    ) -> Action<N> {
        if memory.desired.is_none() && self.settings.bumpless {
            self.law.start(&mut memory.estimates, self.weight_n - self.known_weight_n());
        }
        let reference = match &self.reference {
            Some(reference) => {
                let detours = memory.detours.get_or_insert_with(|| reference.start(state, setpoint));
                reference.advance(detours, state, setpoint)
            }
            None => *setpoint,
        };
        let stands = self.stands(memory);
        let roll_pitch = RollPitch::new(state);
        let hover_n = self.hover_thrust_n(memory);
        let heading = [math::sin(state.attitude_rad.z), math::cos(state.attitude_rad.z)];
        let r = roll_pitch.r_earth_body(heading);
        let up: Vector3<f32> = r.column(2).into();
        let observed_m_s2 = match &self.observer {
            Some(observer) => observer.advance(&mut memory.observed, state, &up, hover_n, [fresh, stands]),
            None => {
                memory.observed = None;
                Vector3::zeros()
            }
        };
        let drag = &self.settings.common.drag;
        let share = math::max(memory.asked.thrust_n, 0.0) / hover_n;
        let observed_rad_s2 = match &self.moments {
            Some(moments) => {
                let known = drag.moment(&r.tr_mul(&state.velocity_m_s), share);
                moments.advance(&mut memory.turned, &state.rates_rad_s, &known, [fresh, stands])
            }
            None => {
                memory.turned = None;
                Vector3::zeros()
            }
        };
        let Cascade { estimates, errors, unallocated, .. } = memory;
        let context = Context {
            state,
            roll_pitch,
            rotor_residual_rad_s: memory.rotor_residual_rad_s,
            dt_s: self.settings.common.dt_s,
            adapt: fresh && !stands,
            unallocated,
            observed_m_s2,
            turns_observed: self.moments.is_some(),
            known: self.settings.feed_forward.then_some(&self.model),
        };
        // References, so that no copy is spilled while a subsystem computes.
        let eta = &state.attitude_rad;
        let by_rotation = self.settings.by_rotation;
        let eta_dot = if self.settings.feed_forward && !by_rotation {
            euler_rates(&state.rates_rad_s, &roll_pitch)
        } else {
            state.rates_rad_s
        };
        memory.turning = [*eta, eta_dot];

        // Position: subsystems 4, 5, 6.
        let (p, v, a) = (&reference.position_m, &reference.velocity_m_s, &reference.acceleration_m_s2);
        let (xi, xi_dot) = (&state.position_m, &state.velocity_m_s);
        let track = |x1, x2, e1, x1d_dot, x1d_ddot| Tracking { x1, x2, e1, x1d_dot, x1d_ddot, approach_1_s: None };
        let approach = |x1: f32, x2, x1d: f32, x1d_dot, x1d_ddot, &(max_m, approach): &(f32, f32)| {
            let distance = x1d - x1;
            let (e1, approach_1_s) =
                if distance.abs() > max_m { (max_m.copysign(distance), Some(approach)) } else { (distance, None) };
            Tracking { x1, x2, e1, x1d_dot, x1d_ddot, approach_1_s }
        };
        let [x_max, y_max, z_max] = &self.approach;
        let z = approach(xi.z, xi_dot.z, p.z, v.z, a.z, z_max);
        let u4 = self.input(Axis::Z, z, &context, &mut estimates.z, &mut errors.z);
        let x = approach(xi.x, xi_dot.x, p.x, v.x, a.x, x_max);
        let u5 = self.input(Axis::X, x, &context, &mut estimates.x, &mut errors.x);
        let y = approach(xi.y, xi_dot.y, p.y, v.y, a.y, y_max);
        let u6 = self.input(Axis::Y, y, &context, &mut estimates.y, &mut errors.y);

        // Desired attitude, with the derivatives for (12) and (16).
        let (vertical, inverse_vertical) = if self.settings.tilt_by_thrust {
            let upward_n = math::min(u4, self.thrust_max_n) * roll_pitch.tilt_cosine();
            let share = math::max(upward_n / hover_n, VERTICAL_MIN);
            (self.gravity_m_s2 * share, self.inverse_gravity / share)
        } else {
            (self.gravity_m_s2, self.inverse_gravity)
        };
        let [a5, a6] = self.limited(u5, u6, vertical);
        let heading_d = if self.settings.by_rotation {
            [math::sin(reference.yaw_rad), math::cos(reference.yaw_rad)]
        } else {
            heading
        };
        let tilt = Tilt::new(a5, a6, heading_d, inverse_vertical);
        let at_rest = |angle| Filtered { angle, rate: 0.0 };
        let (mut commanded, mut forward_rad_s2) = (tilt.rad, [0.0; 2]);
        if self.settings.feed_forward {
            // Drag turns the thrust as it changes with the velocity.
            let thrust = math::min(u4, self.thrust_max_n) / hover_n;
            let jerk = &reference.jerk_m_s3;
            let [by_drag, by_drag_dot] = [drag.change(v, &up, thrust, a), drag.change(v, &up, thrust, jerk)];
            let turn = [reference.yaw_rate_rad_s, reference.yaw_acceleration_rad_s2];
            // Corners of the setpoint are turned gradually; the reference model has none.
            let [followed, snap] = self.forward.advance(&mut memory.followed, setpoint);
            let gradual = followed + (jerk - setpoint.jerk_m_s3);
            let snap = snap - by_drag_dot;
            let [rates, _] = tilt.turned(&(jerk - by_drag), &snap, turn);
            [_, forward_rad_s2] = tilt.turned(&(gradual - by_drag), &snap, turn);
            // Ahead of the filter by its lag: its output is then the angle that was meant.
            let lag_s = self.command_lag_s;
            for ((angle, rate), acceleration) in commanded.iter_mut().zip(rates).zip(forward_rad_s2) {
                *angle += lag_s * (2.0 * rate + lag_s * acceleration);
            }
            // No tilt exceeds the norm of roll and pitch.
            commanded = within(commanded, self.settings.limits.tilt_max_rad);
        }
        let [phi_d, theta_d] = commanded;
        let start = if self.settings.bumpless { [eta.x, eta.y] } else { tilt.rad };
        let filtered = match &memory.desired {
            None => start.map(at_rest),
            Some(Desired { commanded: [phi_d, theta_d], filtered: [roll_d, pitch_d], .. }) => {
                [self.filter.advance(roll_d, *phi_d), self.filter.advance(pitch_d, *theta_d)]
            }
        };
        let [roll_d, pitch_d] = filtered;

        // Attitude: subsystems 1, 2, 3.
        let [roll_d_ddot, pitch_d_ddot] = if self.settings.feed_forward {
            forward_rad_s2
        } else {
            [self.filter.acceleration(&roll_d, phi_d), self.filter.acceleration(&pitch_d, theta_d)]
        };
        let rates_d = Vector3::new(roll_d.rate, pitch_d.rate, reference.yaw_rate_rad_s);
        let accelerations_d = Vector3::new(roll_d_ddot, pitch_d_ddot, reference.yaw_acceleration_rad_s2);
        let Turn { error, rates, accelerations } = if by_rotation {
            let desired = RollPitch::of(roll_d.angle, pitch_d.angle);
            let towards = [&rates_d, &accelerations_d];
            Turn::new(&r, &desired, heading_d, &state.rates_rad_s, towards)
        } else {
            let turn = math::wrap_angle(reference.yaw_rad - eta.z);
            let error = Vector3::new(roll_d.angle - eta.x, pitch_d.angle - eta.y, turn);
            Turn { error, rates: rates_d, accelerations: accelerations_d }
        };
        let roll = track(eta.x, eta_dot.x, error.x, rates.x, accelerations.x);
        let u1 = self.input(Axis::Roll, roll, &context, &mut estimates.roll, &mut errors.roll);
        let pitch = track(eta.y, eta_dot.y, error.y, rates.y, accelerations.y);
        let u2 = self.input(Axis::Pitch, pitch, &context, &mut estimates.pitch, &mut errors.pitch);
        let yaw = track(eta.z, eta_dot.z, error.z, rates.z, accelerations.z);
        let u3 = self.input(Axis::Yaw, yaw, &context, &mut estimates.yaw, &mut errors.yaw);

        // f_hat of roll and pitch behind the filters: it is smooth already, and the observer would feed back their
        // lead.
        let [roll_n, pitch_n, yaw_n] = match &self.moments {
            Some(moments) => {
                // Known is what it will be when the rotors have followed.
                let ahead_m_s = state.velocity_m_s + a * self.settings.disturbance.disturbance_lag_s;
                let known = if stands { Vector3::zeros() } else { drag.moment(&r.tr_mul(&ahead_m_s), share) };
                moments.against(&observed_rad_s2, &known)
            }
            None => [0.0; 3],
        };
        let inputs = Inputs { roll_n: u1, pitch_n: u2, yaw_n: u3 + yaw_n, thrust_n: u4 };
        let mut inputs = self.smoother.advance(&mut memory.smoothed, &inputs);
        let mut effort = 1.0;
        if self.moments.is_some() {
            // Rotors that give less thrust than they should turn the vehicle by less, too.
            let more = &mut memory.more_effort;
            let share = math::min(math::max(hover_n * self.inverse_weight, EFFORT_MIN), EFFORT_MAX);
            *more = math::settled(*more + (share - 1.0 - *more) * self.effort_share);
            effort += *more;
            inputs.roll_n = (inputs.roll_n + roll_n) * effort;
            inputs.pitch_n = (inputs.pitch_n + pitch_n) * effort;
            inputs.yaw_n *= effort;
        }
        // Moments would increase the thrust and tip over a standing vehicle.
        let asked = if stands { Inputs { thrust_n: inputs.thrust_n, ..Inputs::default() } } else { inputs };
        memory.asked = asked;
        let allocation = self.mixer.allocate(&asked);
        let action = self.mixer.carry_out(&allocation);
        if let Some(observer) = &self.observer {
            observer.give(&mut memory.observed, action.given.thrust_n);
        }

        if let Some(moments) = &self.moments {
            moments.give(&mut memory.turned, &action.given, effort);
        }

        let distance_m = p - xi;
        memory.distances = PerAxis {
            roll: memory.errors.roll.e1,
            pitch: memory.errors.pitch.e1,
            yaw: memory.errors.yaw.e1,
            z: distance_m.z,
            x: distance_m.x,
            y: distance_m.y,
        };
        memory.inputs = PerAxis { roll: u1, pitch: u2, yaw: u3, z: u4, x: u5, y: u6 };
        memory.desired = Some(Desired { rad: tilt.rad, commanded, filtered });
        memory.standstill.advance(u4, self.weight_n, &state.velocity_m_s, self.settings.common.dt_s);
        if L::USES_ROTOR_RESIDUAL {
            memory.rotor_residual_rad_s = self.mixer.residual_rad_s(&action.speeds);
        }
        if self.settings.anti_windup {
            let Allocation { unallocated, .. } = allocation;
            memory.unallocated = PerAxis {
                roll: unallocated.roll_n,
                pitch: unallocated.pitch_n,
                yaw: unallocated.yaw_n,
                z: unallocated.thrust_n,
                x: u5 - a5,
                y: u6 - a6,
            };
        }
        action
    }
}

impl<L: Law, const N: usize> FlightController<N> for Controller<L, N> {
    type Memory = Cascade<L::Estimate>;

    fn dt_s(&self) -> f32 {
        self.settings.common.dt_s
    }

    fn mixer(&self) -> &Mixer<N> {
        &self.mixer
    }

    #[inline(always)]
    fn decide(&self, memory: &mut Self::Memory, state: &State, setpoint: &Setpoint, fresh: bool) -> Action<N> {
        self.cascade(memory, state, setpoint, fresh)
    }

    fn position_lost(&self, memory: &mut Self::Memory) {
        if let Some(observed) = &mut memory.observed {
            observed.hold();
        }
    }

    fn trace(memory: &Self::Memory) -> Trace {
        memory.trace()
    }
}

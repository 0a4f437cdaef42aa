//! Six subsystems in one cascade: position gives thrust and desired attitude, attitude gives U1..U3, and all give rotor
//! speeds. Section III-D, Fig. 2.

use crate::disturbance::{DisturbanceObserver, Observed, Observer};
use crate::law::{Context, Law, Tracking};
use crate::limits::Limits;
use crate::model::{Model, RollPitch, euler_rates};
use crate::reference::{Detours, Reference, ReferenceModel};
use crate::standstill::Standstill;
use afbc_control::command_filter::{BANDWIDTH, CommandFilter, Filtered};
use afbc_control::mixer::{Allocation, Mixer};
use afbc_control::{Action, Errors, Estimate, FlightController, Smoothed, Smoother, Smoothing, Trace, math};
use afbc_types::{Airframe, Axis, Declared, Inputs, OutOfRange, Parameters, PerAxis, Setpoint, State, parameters};
use nalgebra::Vector3;

/// Smallest vertical thrust over weight that the tilt is computed with, since a sinking vehicle must not tilt further.
/// Not in the paper.
pub const VERTICAL_MIN: f32 = 0.3;

parameters! {
    /// Settings of the cascade around the law. The defaults are the paper's.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct Settings {
        /// Settings that every controller needs.
        #[group("")]
        pub common: afbc_control::Settings = afbc_control::Settings::DEFAULT,
        /// Bandwidth of the filter on phi_d and theta_d.
        #[parameter(FILTER, "rad/s", BANDWIDTH.min..=BANDWIDTH.max, tuned)]
        pub command_filter_rad_s: f32 = 40.0,
        /// Limits on the demands of position control.
        #[group("limits")]
        pub limits: Limits = Limits::NONE,
        /// Whether the desired attitude is computed with the commanded thrust, instead of the hover thrust (39).
        #[switch(TILT_THRUST)]
        pub tilt_by_thrust: bool = false,
        /// Whether an estimate stops growing in the direction in which rotors, tilt or acceleration are at a limit.
        #[switch(ANTI_WINDUP)]
        pub anti_windup: bool = false,
        /// Whether adaptation stops, and rotors give thrust only, while the vehicle stands on the ground.
        #[switch(FREEZE)]
        pub freeze_on_ground: bool = false,
        /// Whether estimates start with the weight, and the command filter at the attitude, so that a vehicle in flight
        /// is taken over without a jump. The paper starts with zero estimates and at its first command.
        #[switch(BUMPLESS)]
        pub bumpless: bool = false,
        /// Whether the law is given the known part of (16) by the nominal model, so that only the rest is learnt, and
        /// roll and pitch the derivatives that follow from jerk and snap of the setpoint, instead of the command
        /// filter's second derivative, which is mostly noise.
        #[switch(FEED_FORWARD)]
        pub feed_forward: bool = false,
        /// Observer of the horizontal acceleration that the model does not know, for a law that is given what is known.
        #[group("")]
        pub disturbance: DisturbanceObserver = DisturbanceObserver::DEFAULT,
        /// Reference model between setpoint and law.
        #[group("")]
        pub reference: ReferenceModel = ReferenceModel::DEFAULT,
        /// Low-pass filters on U1..U4.
        #[group("")]
        pub smoothing: Smoothing = Smoothing::DEFAULT,
    }
}

impl Settings {
    /// Returns the settings with another time step.
    #[must_use]
    pub const fn with_dt_s(mut self, dt_s: f32) -> Self {
        self.common.dt_s = dt_s;
        self
    }

    /// Returns the settings of a vehicle that is `slowness` times slower: command filter, tilt rate, reference model
    /// and filters of the inputs follow. Limits of speed and acceleration stay, since they belong to the task. Not in
    /// the paper.
    #[must_use]
    pub fn slowed(self, slowness: f32) -> Self {
        let Settings { command_filter_rad_s, limits, disturbance, reference, smoothing, .. } = self;
        Settings {
            command_filter_rad_s: command_filter_rad_s / slowness,
            limits: Limits { tilt_rate_max_rad_s: limits.tilt_rate_max_rad_s / slowness, ..limits },
            disturbance: disturbance.slowed(slowness),
            reference: reference.slowed(slowness),
            smoothing: smoothing.slowed(slowness),
            ..self
        }
    }

    /// Returns the settings with another largest rotor force.
    #[must_use]
    pub const fn with_rotor_force_max_n(mut self, force_n: f32) -> Self {
        self.common.rotor_force_max_n = force_n;
        self
    }
}

/// A controller. Constant; everything that changes in flight is in [`Cascade`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Controller<L, const N: usize = 4> {
    law: L,
    /// Nominal model for the feed-forward.
    model: Model,
    observer: Option<Observer>,
    reference: Option<Reference>,
    smoother: Smoother,
    mixer: Mixer<N>,
    filter: CommandFilter,
    settings: Settings,
    weight_n: f32,
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
    /// See [`Context::unallocated`].
    unallocated: PerAxis<f32>,
    standstill: Standstill,
    rotor_residual_rad_s: f32,
    /// eta and d eta/dt in the last step: the body's rates as in (6), or with feed-forward what follows from them.
    pub(crate) turning: [Vector3<f32>; 2],
    /// See [`Observer`]; none before the first step.
    pub(crate) observed: Option<Observed>,
    /// See [`Reference`]; none before the first step.
    detours: Option<Detours>,
    /// See [`Smoother`].
    smoothed: Option<Smoothed>,
}

impl<E> Cascade<E> {
    /// Returns the memory with the estimates of another law, which starts with this rotor residual.
    pub(crate) fn handed_over<F>(&self, estimates: PerAxis<F>, rotor_residual_rad_s: f32) -> Cascade<F> {
        let Cascade { errors, distances, inputs, asked, desired, unallocated, standstill, .. } = *self;
        let Cascade { turning, observed, detours, smoothed, .. } = *self;
        Cascade {
            estimates,
            errors,
            distances,
            inputs,
            asked,
            desired,
            unallocated,
            standstill,
            rotor_residual_rad_s,
            turning,
            observed,
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

/// Desired roll and pitch, and how they turn with the horizontal acceleration.
struct Tilt {
    sin_psi: f32,
    cos_psi: f32,
    /// phi_d, theta_d of (40) \[rad\].
    rad: [f32; 2],
    /// Derivatives of (40) with yaw and thrust held: d phi/d tan phi cos theta and d theta/d tan theta, over the
    /// vertical acceleration.
    gains: [f32; 2],
}

impl Tilt {
    #[inline(always)]
    fn new(u5: f32, u6: f32, [sin_psi, cos_psi]: [f32; 2], inverse_vertical: f32) -> Self {
        let tan_theta = (u5 * cos_psi + u6 * sin_psi) * inverse_vertical;
        // cos(atan t) = 1 / sqrt(1 + t^2)
        let cos_theta = 1.0 / math::sqrt(1.0 + tan_theta * tan_theta);
        let tan_phi = (u5 * sin_psi - u6 * cos_psi) * inverse_vertical * cos_theta;
        let roll = cos_theta * inverse_vertical / (1.0 + tan_phi * tan_phi);
        Tilt {
            sin_psi,
            cos_psi,
            rad: [math::atan(tan_phi), math::atan(tan_theta)],
            gains: [roll, cos_theta * cos_theta * inverse_vertical],
        }
    }

    /// Returns the derivatives of roll and pitch for that of the acceleration, along x and y.
    #[inline]
    fn turned(&self, x: f32, y: f32) -> [f32; 2] {
        let [roll, pitch] = self.gains;
        [(x * self.sin_psi - y * self.cos_psi) * roll, (x * self.cos_psi + y * self.sin_psi) * pitch]
    }
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
        let model = Model::new(&vehicle.parameters);
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
            // Of a law that is not given what is known, it would be no use.
            observer: (settings.feed_forward && L::OBSERVES)
                .then(|| Observer::new(&settings.disturbance, &vehicle.parameters, settings.common.dt_s))
                .flatten(),
            reference: Reference::new(&settings.reference, &settings.limits, settings.common.dt_s),
            smoother: Smoother::new(&settings.smoothing, settings.common.dt_s)?,
            filter: CommandFilter::new(settings.command_filter_rad_s, settings.common.dt_s)?
                .limited(settings.limits.tilt_rate_max_rad_s)?,
            settings,
            weight_n: vehicle.parameters.weight_n(),
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
        let observed_m_s2 = match &self.observer {
            Some(observer) => {
                observer.advance(&mut memory.observed, state, (&roll_pitch, heading), hover_n, [fresh, stands])
            }
            None => {
                memory.observed = None;
                [0.0; 2]
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
            known: self.settings.feed_forward.then_some(&self.model),
        };
        // References, so that no copy is spilled while a subsystem computes.
        let eta = &state.attitude_rad;
        let eta_dot =
            if self.settings.feed_forward { euler_rates(&state.rates_rad_s, &roll_pitch) } else { state.rates_rad_s };
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
        let tilt = Tilt::new(a5, a6, heading, inverse_vertical);
        let (mut commanded, mut forward_rad_s2) = (tilt.rad, [0.0; 2]);
        if self.settings.feed_forward {
            let (j, s) = (&reference.jerk_m_s3, &reference.snap_m_s4);
            let rates = tilt.turned(j.x, j.y);
            forward_rad_s2 = tilt.turned(s.x, s.y);
            // Ahead of the filter by its lag: its output is then the angle that was meant.
            let lag_s = self.command_lag_s;
            for ((angle, rate), acceleration) in commanded.iter_mut().zip(rates).zip(forward_rad_s2) {
                *angle += lag_s * (2.0 * rate + lag_s * acceleration);
            }
            // No tilt exceeds the norm of roll and pitch.
            commanded = within(commanded, self.settings.limits.tilt_max_rad);
        }
        let [phi_d, theta_d] = commanded;
        let at_rest = |angle| Filtered { angle, rate: 0.0 };
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
        let roll = track(eta.x, eta_dot.x, roll_d.angle - eta.x, roll_d.rate, roll_d_ddot);
        let u1 = self.input(Axis::Roll, roll, &context, &mut estimates.roll, &mut errors.roll);
        let pitch = track(eta.y, eta_dot.y, pitch_d.angle - eta.y, pitch_d.rate, pitch_d_ddot);
        let u2 = self.input(Axis::Pitch, pitch, &context, &mut estimates.pitch, &mut errors.pitch);
        let turn = math::wrap_angle(reference.yaw_rad - eta.z);
        let yaw = track(eta.z, eta_dot.z, turn, reference.yaw_rate_rad_s, reference.yaw_acceleration_rad_s2);
        let u3 = self.input(Axis::Yaw, yaw, &context, &mut estimates.yaw, &mut errors.yaw);

        let inputs = Inputs { roll_n: u1, pitch_n: u2, yaw_n: u3, thrust_n: u4 };
        let inputs = self.smoother.advance(&mut memory.smoothed, &inputs);
        // Moments would increase the thrust and tip over a standing vehicle.
        let asked = if stands { Inputs { thrust_n: inputs.thrust_n, ..Inputs::default() } } else { inputs };
        memory.asked = asked;
        let allocation = self.mixer.allocate(&asked);
        let action = self.mixer.carry_out(&allocation);
        if let Some(observer) = &self.observer {
            observer.give(&mut memory.observed, action.given.thrust_n);
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

    fn adrift(&self, memory: &mut Self::Memory) {
        if let Some(observed) = &mut memory.observed {
            observed.hold();
        }
    }

    fn trace(memory: &Self::Memory) -> Trace {
        memory.trace()
    }

    fn learnt(memory: &Self::Memory) -> PerAxis<Estimate> {
        PerAxis::from_fn(|axis| L::learnt(&memory.estimates[axis]))
    }
}

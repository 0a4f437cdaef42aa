//! Six subsystems in one cascade: position gives thrust and desired attitude, attitude gives U1..U3, and all give rotor
//! speeds. Section III-D, Fig. 2.

use crate::law::{Context, Law, Tracking};
use crate::limits::Limits;
use crate::standstill::Standstill;
use afbc_control::command_filter::{BANDWIDTH, CommandFilter, Filtered};
use afbc_control::mixer::{Allocation, Mixer};
use afbc_control::{Action, Errors, Estimate, FlightController, Trace, math};
use afbc_types::{Airframe, Axis, Declared, Inputs, OutOfRange, Parameters, PerAxis, Setpoint, State, parameters};
use nalgebra::Vector3;

/// Smallest vertical thrust over weight that the tilt is computed with, since a sinking vehicle must not tilt further.
/// Not in the paper.
pub const VERTICAL_MIN: f32 = 0.3;

parameters! {
    /// Settings of the cascade around the law. The defaults are the paper's.
    #[derive(Clone, Copy, Debug, PartialEq)]
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
    }
}

impl Settings {
    /// Returns the settings with another time step.
    #[must_use]
    pub const fn with_dt_s(mut self, dt_s: f32) -> Self {
        self.common.dt_s = dt_s;
        self
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
    mixer: Mixer<N>,
    filter: CommandFilter,
    settings: Settings,
    weight_n: f32,
    gravity_m_s2: f32,
    inverse_gravity: f32,
    tilt_max_tan: f32,
    /// Largest thrust of all rotors together \[N\].
    thrust_max_n: f32,
    /// Largest e_1 of x, y and z \[m\], which gives the speed limit by alpha_1 e_1.
    error_max_m: Vector3<f32>,
}

/// Desired roll and pitch in one step.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Desired {
    /// phi_d, theta_d of (40) \[rad\].
    rad: [f32; 2],
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
    /// Inputs of each subsystem in the last step: U1..U4 \[N\], u5, u6 \[m/s2\].
    pub inputs: PerAxis<f32>,
    /// Desired roll and pitch in the last step; none before the first.
    desired: Option<Desired>,
    /// See [`Context::unallocated`].
    unallocated: PerAxis<f32>,
    standstill: Standstill,
    rotor_residual_rad_s: f32,
}

impl<E> Cascade<E> {
    /// Returns the memory with the estimates of another law, which starts with this rotor residual.
    pub(crate) fn handed_over<F>(&self, estimates: PerAxis<F>, rotor_residual_rad_s: f32) -> Cascade<F> {
        let Cascade { errors, inputs, desired, unallocated, standstill, .. } = *self;
        Cascade { estimates, errors, inputs, desired, unallocated, standstill, rotor_residual_rad_s }
    }

    /// Returns the trace of the last step.
    pub(crate) fn trace(&self) -> Trace {
        let PerAxis { roll, pitch, yaw, z, x, y } = self.inputs;
        let Desired { rad, filtered } = self.desired.unwrap_or(Desired { rad: [0.0; 2], filtered: Default::default() });
        let mut trace = Trace::default();
        trace.inputs = Inputs { roll_n: roll, pitch_n: pitch, yaw_n: yaw, thrust_n: z };
        trace.virtual_m_s2 = [x, y];
        (trace.desired_rad, trace.filtered) = (rad, filtered);
        trace.errors = self.errors;
        trace
    }
}

/// Returns desired roll and pitch (40) \[rad\] for the horizontal accelerations u5, u6 \[m/s2\] at yaw psi \[rad\].
/// `inverse_vertical` is mass over vertical thrust: 1/g in hover, as in (39).
#[inline]
pub fn desired_attitude(u5: f32, u6: f32, yaw_rad: f32, inverse_vertical: f32) -> [f32; 2] {
    let (sin_psi, cos_psi) = (math::sin(yaw_rad), math::cos(yaw_rad));
    let tan_theta = (u5 * cos_psi + u6 * sin_psi) * inverse_vertical;
    // cos(atan t) = 1 / sqrt(1 + t^2)
    let cos_theta = 1.0 / math::sqrt(1.0 + tan_theta * tan_theta);
    let tan_phi = (u5 * sin_psi - u6 * cos_psi) * inverse_vertical * cos_theta;
    [math::atan(tan_phi), math::atan(tan_theta)]
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
        let error_max = |axis, speed| speed / law.alpha1(axis);
        Ok(Controller {
            error_max_m: Vector3::new(
                error_max(Axis::X, speed_max_m_s),
                error_max(Axis::Y, speed_max_m_s),
                error_max(Axis::Z, climb_max_m_s),
            ),
            law,
            filter: CommandFilter::new(settings.command_filter_rad_s, settings.common.dt_s)?
                .limited(settings.limits.tilt_rate_max_rad_s)?,
            settings,
            weight_n: vehicle.parameters.weight_n(),
            gravity_m_s2,
            inverse_gravity: 1.0 / gravity_m_s2,
            tilt_max_tan: math::tan(settings.limits.tilt_max_rad),
            thrust_max_n: mixer.thrust_max_n(),
            mixer,
        })
    }

    /// Returns (u5, u6), reduced to the limits of tilt and acceleration in the same direction.
    #[inline]
    fn limited(&self, u5: f32, u6: f32, vertical: f32) -> [f32; 2] {
        let max = math::min(vertical * self.tilt_max_tan, self.settings.limits.acceleration_max_m_s2);
        let square = u5 * u5 + u6 * u6;
        let scale = if square > max * max { max / math::sqrt(square) } else { 1.0 };
        [u5 * scale, u6 * scale]
    }

    /// Returns the law in the cascade.
    pub(crate) fn law(&self) -> &L {
        &self.law
    }

    /// Returns the estimated hover thrust U4 \[N\], limited to what the rotors can give.
    pub(crate) fn hover_thrust_n(&self, memory: &Cascade<L::Estimate>) -> f32 {
        math::min(self.law.hover_thrust_n(&memory.estimates.z, self.weight_n), self.thrust_max_n)
    }

    /// True if the vehicle stands on the ground and `freeze_on_ground` is set.
    #[inline]
    pub(crate) fn stands(&self, memory: &Cascade<L::Estimate>) -> bool {
        self.settings.freeze_on_ground && memory.standstill.stands()
    }

    /// Computes (7)-(40) in their order; `fresh` as in [`FlightController::decide`].
    #[inline(always)]
    pub(crate) fn cascade(
        &self,
        memory: &mut Cascade<L::Estimate>,
        state: &State,
        setpoint: &Setpoint,
        fresh: bool,
    ) -> Action<N> {
        if memory.desired.is_none() && self.settings.bumpless {
            self.law.start(&mut memory.estimates, self.weight_n);
        }
        let stands = self.stands(memory);
        let context = Context {
            state,
            rotor_residual_rad_s: memory.rotor_residual_rad_s,
            dt_s: self.settings.common.dt_s,
            adapt: fresh && !stands,
            unallocated: memory.unallocated,
        };
        let hover_n = self.hover_thrust_n(memory);
        let Cascade { estimates, errors, .. } = memory;
        let mut input = |axis: Axis, tracking: Tracking| {
            let (u, e) = self.law.input(axis, &tracking, &context, &mut estimates[axis]);
            errors[axis] = e;
            u
        };

        // Position: subsystems 4, 5, 6.
        let (p, v, a) = (setpoint.position_m, setpoint.velocity_m_s, setpoint.acceleration_m_s2);
        let (xi, xi_dot) = (state.position_m, state.velocity_m_s);
        let track = |x1, x2, e1, x1d_dot, x1d_ddot| Tracking { x1, x2, e1, x1d_dot, x1d_ddot, limited: false };
        let approach = |x1: f32, x2, x1d: f32, x1d_dot, x1d_ddot, max: f32| {
            let distance = x1d - x1;
            let limited = distance.abs() > max;
            let e1 = if limited { max.copysign(distance) } else { distance };
            Tracking { x1, x2, e1, x1d_dot, x1d_ddot, limited }
        };
        let max = &self.error_max_m;
        let u4 = input(Axis::Z, approach(xi.z, xi_dot.z, p.z, v.z, a.z, max.z));
        let u5 = input(Axis::X, approach(xi.x, xi_dot.x, p.x, v.x, a.x, max.x));
        let u6 = input(Axis::Y, approach(xi.y, xi_dot.y, p.y, v.y, a.y, max.y));

        // Desired attitude, with the derivatives for (12) and (16).
        let (eta, eta_dot) = (state.attitude_rad, state.rates_rad_s);
        let (vertical, inverse_vertical) = if self.settings.tilt_by_thrust {
            let upward_n = math::min(u4, self.thrust_max_n) * math::tilt_cosine(eta.x, eta.y);
            let share = math::max(upward_n / hover_n, VERTICAL_MIN);
            (self.gravity_m_s2 * share, self.inverse_gravity / share)
        } else {
            (self.gravity_m_s2, self.inverse_gravity)
        };
        let [a5, a6] = self.limited(u5, u6, vertical);
        let desired_rad = desired_attitude(a5, a6, eta.z, inverse_vertical);
        let [phi_d, theta_d] = desired_rad;
        let at_rest = |angle| Filtered { angle, rate: 0.0 };
        let start = if self.settings.bumpless { [eta.x, eta.y] } else { desired_rad };
        let filtered = match &memory.desired {
            None => start.map(at_rest),
            Some(Desired { rad: [phi_d, theta_d], filtered: [roll_d, pitch_d] }) => {
                [self.filter.advance(roll_d, *phi_d), self.filter.advance(pitch_d, *theta_d)]
            }
        };
        let [roll_d, pitch_d] = filtered;

        // Attitude: subsystems 1, 2, 3.
        let roll_d_ddot = self.filter.acceleration(&roll_d, phi_d);
        let pitch_d_ddot = self.filter.acceleration(&pitch_d, theta_d);
        let u1 = input(Axis::Roll, track(eta.x, eta_dot.x, roll_d.angle - eta.x, roll_d.rate, roll_d_ddot));
        let u2 = input(Axis::Pitch, track(eta.y, eta_dot.y, pitch_d.angle - eta.y, pitch_d.rate, pitch_d_ddot));
        let u3 = input(
            Axis::Yaw,
            Tracking {
                x1: eta.z,
                x2: eta_dot.z,
                e1: math::wrap_angle(setpoint.yaw_rad - eta.z),
                x1d_dot: setpoint.yaw_rate_rad_s,
                x1d_ddot: setpoint.yaw_acceleration_rad_s2,
                limited: false,
            },
        );

        let inputs = Inputs { roll_n: u1, pitch_n: u2, yaw_n: u3, thrust_n: u4 };
        // Moments would increase the thrust and tip over a standing vehicle.
        let asked = if stands { Inputs { thrust_n: u4, ..Inputs::default() } } else { inputs };
        let allocation = self.mixer.allocate(&asked);
        let action = self.mixer.carry_out(&allocation);

        memory.inputs = PerAxis { roll: u1, pitch: u2, yaw: u3, z: u4, x: u5, y: u6 };
        memory.desired = Some(Desired { rad: desired_rad, filtered });
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

    fn trace(memory: &Self::Memory) -> Trace {
        memory.trace()
    }

    fn learnt(memory: &Self::Memory) -> PerAxis<Estimate> {
        PerAxis::from_fn(|axis| L::learnt(&memory.estimates[axis]))
    }
}

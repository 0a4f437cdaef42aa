//! Six subsystems in one cascade: position gives thrust and desired attitude, attitude gives U1..U3, all give rotor
//! speeds. Section III-D, Fig. 2.

use crate::adaptive::Estimate;
use crate::allocation::{Allocation, FORCE_MAX, Mixer};
use crate::backstepping::{Errors, Tracking};
use crate::command_filter::{CommandFilter, Filtered};
use crate::ground::Ground;
use crate::limits::Limits;
use crate::math;
use crate::monitor::Trip;
use afbc_types::{Axis, Inputs, OutOfRange, Parameters, PerAxis, Range, RotorForces, RotorSpeeds, Setpoint, State};
use nalgebra::Vector3;

/// Accepted time between steps \[s\].
pub const DT: Range = Range::new("dt_s", 1e-4, 0.02);

/// Least vertical part of thrust over weight that a tilt is worked out with: what sinks faster does not tilt more. Ours.
pub const VERTICAL_MIN: f32 = 0.3;

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

/// Settings of the cascade around the law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Time between steps \[s\].
    pub dt_s: f32,
    /// Bandwidth of the filter on phi_d and theta_d \[rad/s\].
    pub command_filter_rad_s: f32,
    /// Largest force of one rotor \[N\].
    pub rotor_force_max_n: f32,
    /// What position control may ask for.
    pub limits: Limits,
    /// Whether the desired attitude comes from the thrust really commanded; otherwise from (39), the thrust of hovering.
    pub tilt_by_thrust: bool,
    /// Whether an estimate stops growing towards a limit of rotors, tilt or acceleration that has been reached.
    pub heed_saturation: bool,
    /// Whether estimates stay as they are, and rotors give thrust alone, while the vehicle stands on the
    /// [`ground`](crate::ground).
    pub heed_ground: bool,
    /// Whether to take over a vehicle in flight as it is: estimates that carry its weight, a command filter that starts
    /// at its attitude. The paper starts from estimates of zero and at its first command.
    pub bumpless: bool,
}

impl Settings {
    /// Checks every setting.
    ///
    /// # Errors
    /// The first one out of range.
    pub fn validate(&self) -> Result<(), OutOfRange> {
        DT.check(self.dt_s)?;
        crate::command_filter::BANDWIDTH.check(self.command_filter_rad_s)?;
        FORCE_MAX.check(self.rotor_force_max_n)?;
        self.limits.validate()
    }
}

/// A controller: fixed from here on. What changes in flight is in [`Cascade`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Controller<L> {
    law: L,
    mixer: Mixer,
    filter: CommandFilter,
    settings: Settings,
    weight_n: f32,
    gravity_m_s2: f32,
    inverse_gravity: f32,
    tilt_max_tan: f32,
    /// What all rotors give together \[N\].
    thrust_max_n: f32,
    /// Largest e_1 of x, y and z \[m\]: alpha_1 times it is the largest speed.
    error_max_m: Vector3<f32>,
}

/// What the cascade remembers between steps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cascade<E> {
    /// Estimates of each subsystem.
    pub estimates: PerAxis<E>,
    /// Errors of each subsystem in the last step.
    pub errors: PerAxis<Errors>,
    /// Filtered phi_d and theta_d; none before the first step.
    filtered: Option<[Filtered; 2]>,
    /// See [`Context::unallocated`].
    unallocated: PerAxis<f32>,
    ground: Ground,
    rotor_residual_rad_s: f32,
}

impl<E> Cascade<E> {
    /// The same flight with other estimates, of another law.
    pub(crate) fn handed_over<F>(&self, estimates: PerAxis<F>) -> Cascade<F> {
        let Cascade { errors, filtered, unallocated, ground, rotor_residual_rad_s, .. } = *self;
        Cascade { estimates, errors, filtered, unallocated, ground, rotor_residual_rad_s }
    }
}

/// What went wrong in a step; all false in normal flight.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Health {
    /// The measurement was implausible (see [`State::is_plausible`]); the last plausible one stood in for it and no
    /// estimate changed. If there was none yet, the rotors stay still.
    pub state_rejected: bool,
    /// The setpoint was implausible; the last plausible one stood in for it, or if there was none yet, a hold of the
    /// position of that moment.
    pub setpoint_rejected: bool,
    /// A rotor was asked for a force outside its limits.
    pub saturated: bool,
    /// Why AFBC does not fly any more, if its [`monitor`](crate::monitor) has tripped.
    pub trip: Option<Trip>,
}

/// What one step decides, and why.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Command {
    /// omega_i, always finite and never negative.
    pub speeds: RotorSpeeds,
    /// F_i, within the rotors' limits.
    pub forces: RotorForces,
    /// U1..U4 as the law wants them, before rotor limits.
    pub inputs: Inputs,
    /// u5, u6: wanted acceleration along x and y \[m/s2\].
    pub virtual_m_s2: [f32; 2],
    /// phi_d, theta_d of (40) \[rad\].
    pub desired_rad: [f32; 2],
    /// phi_d, theta_d behind the command filter: what roll and pitch track.
    pub filtered: [Filtered; 2],
    /// Errors of each subsystem.
    pub errors: PerAxis<Errors>,
    /// What went wrong.
    pub health: Health,
}

impl Command {
    /// What each subsystem wants: U1..U4 \[N\], u5, u6 \[m/s2\].
    pub fn per_axis(&self) -> PerAxis<f32> {
        let Inputs { roll_n, pitch_n, yaw_n, thrust_n } = self.inputs;
        let [x, y] = self.virtual_m_s2;
        PerAxis { roll: roll_n, pitch: pitch_n, yaw: yaw_n, z: thrust_n, x, y }
    }
}

/// Desired roll and pitch (40) \[rad\] for the wanted horizontal accelerations u5, u6 \[m/s2\] at yaw
/// psi \[rad\]. `inverse_vertical` is mass over the vertical part of thrust: 1/g in hover, as in (39).
#[inline]
pub fn desired_attitude(u5: f32, u6: f32, yaw_rad: f32, inverse_vertical: f32) -> [f32; 2] {
    let (sin_psi, cos_psi) = (math::sin(yaw_rad), math::cos(yaw_rad));
    let tan_theta = (u5 * cos_psi + u6 * sin_psi) * inverse_vertical;
    // cos(atan t) = 1 / sqrt(1 + t^2)
    let cos_theta = 1.0 / math::sqrt(1.0 + tan_theta * tan_theta);
    let tan_phi = (u5 * sin_psi - u6 * cos_psi) * inverse_vertical * cos_theta;
    [math::atan(tan_phi), math::atan(tan_theta)]
}

impl<L: Law> Controller<L> {
    /// A controller for a vehicle with these nominal parameters.
    ///
    /// # Errors
    /// The first parameter or setting out of range.
    pub fn new(vehicle: Parameters, settings: Settings, law: L) -> Result<Self, OutOfRange> {
        settings.validate()?;
        let Limits { speed_max_m_s, climb_max_m_s, .. } = settings.limits;
        let error_max = |axis, speed| speed / law.alpha1(axis);
        Ok(Controller {
            error_max_m: Vector3::new(
                error_max(Axis::X, speed_max_m_s),
                error_max(Axis::Y, speed_max_m_s),
                error_max(Axis::Z, climb_max_m_s),
            ),
            law,
            mixer: Mixer::new(&vehicle, settings.rotor_force_max_n)?,
            filter: CommandFilter::new(settings.command_filter_rad_s, settings.dt_s)?
                .limited(settings.limits.tilt_rate_max_rad_s)?,
            settings,
            weight_n: vehicle.mass_kg * vehicle.gravity_m_s2,
            gravity_m_s2: vehicle.gravity_m_s2,
            inverse_gravity: 1.0 / vehicle.gravity_m_s2,
            tilt_max_tan: math::tan(settings.limits.tilt_max_rad),
            thrust_max_n: 4.0 * settings.rotor_force_max_n,
        })
    }

    /// The part of (u5, u6) that tilt and acceleration limits leave, its direction kept.
    #[inline]
    fn limited(&self, u5: f32, u6: f32, vertical: f32) -> [f32; 2] {
        let max = math::min(vertical * self.tilt_max_tan, self.settings.limits.acceleration_max_m_s2);
        let square = u5 * u5 + u6 * u6;
        let scale = if square > max * max { max / math::sqrt(square) } else { 1.0 };
        [u5 * scale, u6 * scale]
    }

    /// The law in the cascade.
    pub(crate) fn law(&self) -> &L {
        &self.law
    }

    /// U4 that it takes to hover \[N\], by what has been learnt: no more than the rotors give.
    pub(crate) fn hover_thrust_n(&self, memory: &Cascade<L::Estimate>) -> f32 {
        math::min(self.law.hover_thrust_n(&memory.estimates.z, self.weight_n), self.thrust_max_n)
    }

    /// True if the ground carries the vehicle, as far as that is heeded.
    #[inline]
    pub(crate) fn stands(&self, memory: &Cascade<L::Estimate>) -> bool {
        self.settings.heed_ground && memory.ground.standing()
    }

    /// (7)-(40) in their order; `fresh` as in [`FlightController::decide`](crate::FlightController::decide).
    #[inline(always)]
    pub(crate) fn cascade(
        &self,
        memory: &mut Cascade<L::Estimate>,
        state: &State,
        setpoint: &Setpoint,
        fresh: bool,
    ) -> Command {
        if memory.filtered.is_none() && self.settings.bumpless {
            self.law.start(&mut memory.estimates, self.weight_n);
        }
        let stands = self.stands(memory);
        let context = Context {
            state,
            rotor_residual_rad_s: memory.rotor_residual_rad_s,
            dt_s: self.settings.dt_s,
            adapt: fresh && !stands,
            unallocated: memory.unallocated,
        };
        let hover_n = self.hover_thrust_n(memory);
        let Cascade { estimates, errors, .. } = memory;
        let mut input = |axis: Axis, tracking: Tracking| {
            let (u, e) = self.law.input(axis, &tracking, &context, estimates.get_mut(axis));
            *errors.get_mut(axis) = e;
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

        // Desired attitude with the derivatives that (12) and (16) ask for.
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
        let filtered = memory.filtered.unwrap_or(start.map(at_rest));
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
        // Moments would keep the thrust up, and tip a vehicle over that stands.
        let asked = if stands { Inputs { thrust_n: u4, ..Inputs::default() } } else { inputs };
        let Allocation { forces, unallocated, saturated } = self.mixer.allocate(&asked);
        let speeds = self.mixer.speeds(&forces);
        let health = Health { saturated, ..Health::default() };

        memory.filtered = Some([self.filter.advance(&roll_d, phi_d), self.filter.advance(&pitch_d, theta_d)]);
        memory.ground.advance(u4, self.weight_n, &state.velocity_m_s, self.settings.dt_s);
        memory.rotor_residual_rad_s = speeds.residual_rad_s();
        if self.settings.heed_saturation {
            memory.unallocated = PerAxis {
                roll: unallocated.roll_n,
                pitch: unallocated.pitch_n,
                yaw: unallocated.yaw_n,
                z: unallocated.thrust_n,
                x: u5 - a5,
                y: u6 - a6,
            };
        }
        Command { speeds, forces, inputs, virtual_m_s2: [u5, u6], desired_rad, filtered, errors: memory.errors, health }
    }
}

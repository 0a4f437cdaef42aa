//! Cascade of six subsystems: position gives thrust and desired attitude, attitude gives U1..U3, and the mixer turns
//! these into rotor speeds. Section III-D, Fig. 2.

use crate::delay_compensation::DelayCompensation;
use crate::desired::{DesiredAttitude, DesiredMemory, DesiredRollPitch};
use crate::disturbance::{ForceObserver, ForceObserverMemory, ObserverConditions};
use crate::effort::Effort;
use crate::law::{StepContext, SubsystemLaw, SubsystemTracking};
use crate::limits::ApproachLimit;
use crate::model::{Attitude, ModelConstants, RollPitch, euler_rates};
use crate::moments::{MomentObserver, MomentObserverMemory};
use crate::reference::{ReferenceFilter, ReferenceMemory};
use crate::rotation::AttitudeTracking;
pub use crate::settings::Settings;
use crate::standstill::StandstillDetector;
use afbc_control::drag::KnownDrag;
use afbc_control::mixer::Mixer;
use afbc_control::{Action, Errors, FlightController, Smoothed, Smoother, Trace, math};
use afbc_types::{Airframe, Axis, Declared, Inputs, OutOfRange, PerAxis, Setpoint, State};
use nalgebra::{Vector2, Vector3};

/// Controller with its constants. Everything that changes in flight is in [`CascadeMemory`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Controller<L, const N: usize = 4> {
    law: L,
    /// Nominal model for the feed-forward.
    model: ModelConstants,
    reference: Option<ReferenceFilter>,
    forces: Option<ForceObserver>,
    moments: Option<MomentObserver>,
    /// Speed limits of x, y and z.
    approach: [ApproachLimit; 3],
    desired: DesiredAttitude,
    smoother: Smoother,
    delay_compensation: DelayCompensation,
    effort: Effort,
    mixer: Mixer<N>,
    settings: StepSettings,
    weight_n: f32,
    mass_kg: f32,
    /// Largest total thrust of all rotors \[N\].
    thrust_max_n: f32,
}

/// Settings that every step reads: the rest is in the parts of the [`Controller`], and would take memory twice.
#[derive(Clone, Copy, Debug, PartialEq)]
struct StepSettings {
    dt_s: f32,
    drag: KnownDrag,
    /// Rotor lag \[s\].
    lag_s: f32,
    anti_windup: bool,
    freeze_on_ground: bool,
    bumpless: bool,
    feed_forward: bool,
    by_rotation: bool,
}

impl From<&Settings> for StepSettings {
    fn from(settings: &Settings) -> Self {
        let Settings {
            common, disturbance, anti_windup, freeze_on_ground, bumpless, feed_forward, by_rotation, ..
        } = *settings;
        let afbc_control::Settings { dt_s, drag, .. } = common;
        let lag_s = disturbance.disturbance_lag_s;
        StepSettings { dt_s, drag, lag_s, anti_windup, freeze_on_ground, bumpless, feed_forward, by_rotation }
    }
}

/// Memory of the cascade.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CascadeMemory<E> {
    /// Estimates of each subsystem.
    pub estimates: PerAxis<E>,
    /// Results of the last step.
    pub last: LastStep,
    pub(crate) filters: FilterMemories,
    rotor_residual_rad_s: f32,
}

/// Results of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LastStep {
    /// Errors of each subsystem.
    pub errors: PerAxis<Errors>,
    /// Distance of each subsystem from its reference: e_1 without the speed limit \[m or rad\].
    pub distances: PerAxis<f32>,
    /// Inputs of each subsystem: U1..U4 \[N\], u5, u6 \[m/s2\].
    pub inputs: PerAxis<f32>,
    /// U1..U4 after the filters, as given to the mixer.
    pub commanded: Inputs,
    /// Part of each input that was not allocated, see [`StepContext::unallocated`].
    unallocated: PerAxis<f32>,
    /// eta: roll, pitch and yaw \[rad\].
    pub(crate) eta: Vector3<f32>,
    /// d eta/dt \[rad/s\]. Without feed-forward, the body rates are taken for d eta/dt, as in (6). With feed-forward, d
    /// eta/dt is computed from the body rates.
    pub(crate) eta_dot: Vector3<f32>,
}

/// Memories of the filters and observers around the law.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct FilterMemories {
    /// Reference filter, `None` before the first step.
    reference: Option<ReferenceMemory>,
    pub(crate) forces: Option<ForceObserverMemory>,
    moments: Option<MomentObserverMemory>,
    desired: DesiredMemory,
    smoothed: Option<Smoothed>,
    /// Low-pass of [`DelayCompensation`].
    delay_low_pass: Option<Vector2<f32>>,
    /// Memory of [`Effort`].
    effort_excess: f32,
    standstill: StandstillDetector,
}

impl<E> CascadeMemory<E> {
    /// Returns the memory with the estimates of another law, which starts with this rotor residual.
    pub(crate) fn handed_over<F>(&self, estimates: PerAxis<F>, rotor_residual_rad_s: f32) -> CascadeMemory<F> {
        // Filters and observers keep their memory, so no input jumps and observed disturbances stay compensated.
        let CascadeMemory { last, filters, .. } = *self;
        CascadeMemory { estimates, last, filters, rotor_residual_rad_s }
    }

    /// Returns the trace of the last step.
    pub(crate) fn trace(&self) -> Trace {
        let LastStep { errors, inputs: PerAxis { x, y, .. }, commanded, .. } = self.last;
        let mut trace = Trace::default();
        trace.inputs = commanded;
        trace.virtual_m_s2 = [x, y];
        (trace.desired_rad, trace.filtered) = self.filters.desired.trace();
        trace.errors = errors;
        trace
    }
}

impl<L: SubsystemLaw, const N: usize> Controller<L, N> {
    /// Creates a controller for a vehicle with these nominal parameters.
    ///
    /// # Errors
    /// Returns the first parameter or setting that is out of range.
    pub fn new(vehicle: impl Into<Airframe<N>>, settings: Settings, law: L) -> Result<Self, OutOfRange> {
        settings.validate()?;
        let vehicle = vehicle.into();
        let mixer = settings.common.mixer(vehicle)?;
        let thrust_max_n = mixer.thrust_max_n();
        let Settings { common, limits, disturbance, .. } = &settings;
        let dt_s = common.dt_s;
        let model = ModelConstants::new(&vehicle.parameters);
        let known = settings.feed_forward.then_some(&model);
        let [roll_n, pitch_n] = mixer.tilt_authority_n(vehicle.parameters.weight_n());
        let authority_rad_s2 = [roll_n * model.hover_gain(Axis::Roll), pitch_n * model.hover_gain(Axis::Pitch)];
        let approach = |axis, speed_max_m_s| ApproachLimit::new(speed_max_m_s, law.approach(axis, known));
        // Without feed-forward the observers would have no effect. The same holds for a law that does not use
        // feed-forward.
        let observes = settings.feed_forward && L::OBSERVES;
        Ok(Controller {
            approach: [
                approach(Axis::X, limits.speed_max_m_s),
                approach(Axis::Y, limits.speed_max_m_s),
                approach(Axis::Z, limits.climb_max_m_s),
            ],
            law,
            model,
            forces: observes
                .then(|| ForceObserver::new(disturbance, common, &vehicle.parameters))
                .transpose()?
                .flatten(),
            moments: observes
                .then(|| MomentObserver::new(disturbance, &vehicle.parameters, thrust_max_n, dt_s))
                .flatten(),
            reference: ReferenceFilter::new(&settings.reference, limits, dt_s),
            desired: DesiredAttitude::new(&settings, vehicle.parameters.gravity_m_s2, thrust_max_n, authority_rad_s2)?,
            smoother: Smoother::new(&settings.smoothing, dt_s)?,
            delay_compensation: DelayCompensation::new(
                disturbance.disturbance_lag_s,
                &settings.smoothing,
                settings.command_filter_rad_s,
                dt_s,
            ),
            effort: Effort::new(vehicle.parameters.weight_n(), dt_s),
            settings: (&settings).into(),
            weight_n: vehicle.parameters.weight_n(),
            mass_kg: vehicle.parameters.mass_kg,
            thrust_max_n,
            mixer,
        })
    }

    /// Returns true if the law gets the known part of its input.
    pub(crate) fn feeds_forward(&self) -> bool {
        self.settings.feed_forward
    }

    /// Returns the law in the cascade.
    pub(crate) fn law(&self) -> &L {
        &self.law
    }

    /// Returns the estimated hover thrust U4 \[N\], limited to what the rotors can give.
    pub(crate) fn hover_thrust_n(&self, memory: &CascadeMemory<L::Estimate>) -> f32 {
        let observed_n = self.forces.as_ref().and_then(|forces| forces.hover_thrust_n(&memory.filters.forces));
        let hover_n = observed_n
            .unwrap_or_else(|| self.law.hover_thrust_n(&memory.estimates.z, self.weight_n, self.known_weight_n()));
        // (40) divides the commanded thrust by the hover thrust, so both need the same limit.
        math::min(hover_n, self.thrust_max_n)
    }

    /// Returns the part of the weight \[N\] that the law need not learn.
    fn known_weight_n(&self) -> f32 {
        if self.settings.feed_forward { self.weight_n } else { 0.0 }
    }

    /// Returns true if the vehicle stands on the ground and `freeze_on_ground` is set.
    #[inline]
    pub(crate) fn is_standing(&self, memory: &CascadeMemory<L::Estimate>) -> bool {
        self.settings.freeze_on_ground && memory.filters.standstill.is_standing()
    }

    /// Computes (7)-(40) in their order; `fresh` as in [`FlightController::decide`].
    #[inline(never)]
    pub(crate) fn cascade(
        &self,
        memory: &mut CascadeMemory<L::Estimate>,
        state: &State,
        setpoint: &Setpoint,
        fresh: bool,
    ) -> Action<N> {
        if self.settings.bumpless && memory.filters.desired.is_first() {
            // The law must not learn the weight that feed-forward already knows, or it would be carried twice.
            self.law.start(&mut memory.estimates, self.weight_n - self.known_weight_n());
        }
        let (hover_n, stands) = (self.hover_thrust_n(memory), self.is_standing(memory));
        let touches_ground = self.settings.freeze_on_ground && memory.filters.standstill.is_touching_ground();
        let low_tan =
            if self.settings.freeze_on_ground { memory.filters.standstill.tilt_max_tan() } else { f32::INFINITY };
        let CascadeMemory { estimates, last, filters, rotor_residual_rad_s } = memory;
        let reference = self.reference(&mut filters.reference, state, setpoint);
        let attitude = Attitude::of(state);
        // Drag is computed before the thrust, so it uses the last step's. A law may ask for negative thrust; `hover_n`
        // is positive.
        let share = math::max(last.commanded.thrust_n, 0.0) / hover_n;
        let conditions = ObserverConditions { fresh, touches_ground };
        let observed_m_s2 = self.observe_forces(&mut filters.forces, state, &attitude, hover_n, conditions);
        let gyroscopic_rad_s2 = self.model.gyroscopic(&state.rates_rad_s, *rotor_residual_rad_s);
        let velocity_body_m_s = attitude.in_body(&state.velocity_m_s);
        // The moment observer gets the known moments, which it would otherwise compensate a second time.
        let known_rad_s2 = gyroscopic_rad_s2 + self.drag_acceleration_rad_s2(&velocity_body_m_s, share);
        let observed_rad_s2 = self.observe_moments(&mut filters.moments, &state.rates_rad_s, &known_rad_s2, conditions);
        let context = StepContext {
            state,
            roll_pitch: attitude.roll_pitch,
            rotor_residual_rad_s: *rotor_residual_rad_s,
            dt_s: self.settings.dt_s,
            // On the ground the feet hold the vehicle against everything but the thrust, so only the thrust is learnt.
            adapt: fresh && !touches_ground,
            adapt_z: fresh && !stands,
            unallocated: &last.unallocated,
            observed_m_s2,
            softness: filters.forces.as_ref().map_or(1.0, ForceObserverMemory::softness),
            known: self.settings.feed_forward.then_some(&self.model),
        };
        let eta_dot = self.eta_dot(state, &attitude);

        // Position: subsystems 4, 5, 6.
        let [u4, u5, u6] = self.position(&reference, &context, estimates, &mut last.errors);
        // Desired roll and pitch (40), with the derivatives for (12) and (16).
        let followed = [&reference, setpoint];
        let desired = self.desired.advance(
            &mut filters.desired,
            [u5, u6, u4],
            [hover_n, low_tan, state.velocity_m_s.z],
            &attitude,
            followed,
        );
        // Attitude: subsystems 1, 2, 3.
        let mut tracking = self.attitude_tracking(&desired, &reference, &attitude, state);
        if self.settings.feed_forward {
            // Without the measured body rates, whose noise the lead would amplify.
            let more =
                self.delay_compensation.advance(&mut filters.delay_low_pass, &tracking.desired_accelerations.xy());
            tracking.accelerations += Vector3::new(more.x, more.y, 0.0);
        }
        let [u1, u2, u3] =
            self.attitude(&tracking, [&state.attitude_rad, &eta_dot], &context, estimates, &mut last.errors);

        // Rotors. Moments are compensated at their predicted value after the rotor lag. In rotating axes (R' v)' = R'
        // dv/dt - Omega x R' v, because the drag's moment turns with the body.
        let change = attitude.in_body(&reference.acceleration_m_s2) - state.rates_rad_s.cross(&velocity_body_m_s);
        let ahead_m_s = velocity_body_m_s + change * self.settings.lag_s;
        let compensation_n = self.moment_compensation_n(&observed_rad_s2, &ahead_m_s, share, touches_ground);
        let ahead_n = self.mass_kg * self.delay_compensation.thrust_s * desired.thrust_m_s3;
        let (commanded, effort) =
            self.commanded_inputs(filters, [u1, u2, u3, u4 + ahead_n], compensation_n, hover_n, stands);
        let allocation = self.mixer.allocate(&commanded);
        let action = self.mixer.carry_out(&allocation);

        // The next step's observer needs the thrust.
        if let Some(forces) = &self.forces {
            // The observer gets the thrust that the rotors give, not the commanded thrust. Otherwise the observer would
            // take the part beyond the rotors' limits for a disturbance.
            forces.record_thrust(&mut filters.forces, action.given.thrust_n);
        }
        if let Some(moments) = &self.moments {
            moments.record_inputs(&mut filters.moments, &action.given, effort);
        }
        let pushed_m_s2 = filters.forces.as_ref().map_or(0.0, ForceObserverMemory::pushed_m_s2);
        let along_z = [reference.velocity_m_s.z, pushed_m_s2];
        filters.standstill.advance([u4, self.weight_n], state, along_z, self.settings.dt_s);
        let leaves_ground = touches_ground && !filters.standstill.is_touching_ground();
        // The way back after sliding on the ground must not be learnt as a disturbance.
        if let (true, Some(reference), Some(memory)) = (leaves_ground, &self.reference, &mut filters.reference) {
            reference.restart_horizontal(memory, state, setpoint);
        }
        if L::USES_ROTOR_RESIDUAL {
            *rotor_residual_rad_s = self.mixer.residual_rad_s(&action.speeds);
        }
        if self.settings.anti_windup {
            let Inputs { roll_n, pitch_n, yaw_n, thrust_n } = allocation.unallocated;
            let [x, y] = desired.beyond_limits_m_s2;
            last.unallocated = PerAxis { roll: roll_n, pitch: pitch_n, yaw: yaw_n, z: thrust_n, x, y };
        }
        // e_1 of x, y and z is cut at the speed limit, so the monitor gets the uncut distances.
        let PerAxis { roll, pitch, yaw, .. } = &last.errors;
        let [x, y, z] = (reference.position_m - state.position_m).into();
        last.distances = PerAxis { roll: roll.e1, pitch: pitch.e1, yaw: yaw.e1, z, x, y };
        last.inputs = PerAxis { roll: u1, pitch: u2, yaw: u3, z: u4, x: u5, y: u6 };
        (last.eta, last.eta_dot) = (state.attitude_rad, eta_dot);
        last.commanded = commanded;
        action
    }

    /// Returns the setpoint, or the output of the reference model for it.
    #[inline(always)]
    fn reference(&self, memory: &mut Option<ReferenceMemory>, state: &State, setpoint: &Setpoint) -> Setpoint {
        match &self.reference {
            Some(reference) => {
                let memory = memory.get_or_insert_with(|| reference.start(state, setpoint));
                reference.advance(memory, state, setpoint)
            }
            None => *setpoint,
        }
    }

    /// Returns the observed f of x, y and z \[m/s2\].
    #[inline(always)]
    fn observe_forces(
        &self,
        observed: &mut Option<ForceObserverMemory>,
        state: &State,
        attitude: &Attitude,
        hover_n: f32,
        conditions: ObserverConditions,
    ) -> Vector3<f32> {
        match &self.forces {
            Some(forces) => forces.advance(observed, state, &attitude.up(), hover_n, conditions),
            None => {
                *observed = None;
                Vector3::zeros()
            }
        }
    }

    /// Returns the angular acceleration by the rotors' drag \[rad/s2\], for this velocity in body axes and `share` of
    /// the hover thrust. Zero without a moment observer.
    #[inline(always)]
    fn drag_acceleration_rad_s2(&self, velocity_body_m_s: &Vector3<f32>, share: f32) -> Vector3<f32> {
        match &self.moments {
            Some(moments) => moments.angular_acceleration_rad_s2(&self.settings.drag.moment(velocity_body_m_s, share)),
            None => Vector3::zeros(),
        }
    }

    /// Returns the observed f of roll, pitch and yaw \[rad/s2\] in addition to `known_rad_s2`.
    #[inline(always)]
    fn observe_moments(
        &self,
        observed: &mut Option<MomentObserverMemory>,
        rates_rad_s: &Vector3<f32>,
        known_rad_s2: &Vector3<f32>,
        conditions: ObserverConditions,
    ) -> Vector3<f32> {
        match &self.moments {
            Some(moments) => moments.advance(observed, rates_rad_s, known_rad_s2, conditions),
            None => {
                *observed = None;
                Vector3::zeros()
            }
        }
    }

    /// Returns d eta/dt. Returns the body rates instead if the settings take the body rates for d eta/dt.
    #[inline(always)]
    fn eta_dot(&self, state: &State, attitude: &Attitude) -> Vector3<f32> {
        if self.settings.feed_forward && !self.settings.by_rotation {
            euler_rates(&state.rates_rad_s, &attitude.roll_pitch)
        } else {
            state.rates_rad_s
        }
    }

    /// Computes the input of one subsystem and its errors.
    // This function is always inlined, so that all subsystems share common computations.
    #[inline(always)]
    fn input(
        &self,
        axis: Axis,
        tracking: SubsystemTracking,
        context: &StepContext,
        estimate: &mut L::Estimate,
        errors: &mut Errors,
    ) -> f32 {
        let (u, e) = self.law.input(axis, &tracking, context, estimate);
        *errors = e;
        u
    }

    /// Returns U4 \[N\], u5 and u6 \[m/s2\]: subsystems 4, 5 and 6.
    #[inline(always)]
    fn position(
        &self,
        reference: &Setpoint,
        context: &StepContext,
        estimates: &mut PerAxis<L::Estimate>,
        errors: &mut PerAxis<Errors>,
    ) -> [f32; 3] {
        let State { position_m: xi, velocity_m_s: xi_dot, .. } = context.state;
        let Setpoint { position_m: p, velocity_m_s: v, acceleration_m_s2: a, .. } = reference;
        let [x, y, z] = &self.approach;
        let (x, y, z) = (
            x.tracking([xi.x, xi_dot.x], [p.x, v.x, a.x]),
            y.tracking([xi.y, xi_dot.y], [p.y, v.y, a.y]),
            z.tracking([xi.z, xi_dot.z], [p.z, v.z, a.z]),
        );
        let u4 = self.input(Axis::Z, z, context, &mut estimates.z, &mut errors.z);
        let u5 = self.input(Axis::X, x, context, &mut estimates.x, &mut errors.x);
        let u6 = self.input(Axis::Y, y, context, &mut estimates.y, &mut errors.y);
        [u4, u5, u6]
    }

    /// Returns errors and reference derivatives for roll, pitch and yaw.
    #[inline(always)]
    fn attitude_tracking(
        &self,
        desired: &DesiredRollPitch,
        reference: &Setpoint,
        attitude: &Attitude,
        state: &State,
    ) -> AttitudeTracking {
        let [roll, pitch] = &desired.filtered;
        let [roll_ddot, pitch_ddot] = desired.accelerations_rad_s2;
        let rates = Vector3::new(roll.rate, pitch.rate, reference.yaw_rate_rad_s);
        let accelerations = Vector3::new(roll_ddot, pitch_ddot, reference.yaw_acceleration_rad_s2);
        if self.settings.by_rotation {
            let roll_pitch = RollPitch::of(roll.angle, pitch.angle);
            let (r, omega) = (&attitude.r_earth_body, &state.rates_rad_s);
            AttitudeTracking::new(r, &roll_pitch, desired.heading, omega, [&rates, &accelerations])
        } else {
            let eta_d = Vector3::new(roll.angle, pitch.angle, reference.yaw_rad);
            AttitudeTracking::of_angles(&eta_d, &state.attitude_rad, rates, accelerations)
        }
    }

    /// Returns U1..U3 \[N\]: subsystems 1, 2, 3.
    #[inline(always)]
    fn attitude(
        &self,
        tracking: &AttitudeTracking,
        [eta, eta_dot]: [&Vector3<f32>; 2],
        context: &StepContext,
        estimates: &mut PerAxis<L::Estimate>,
        errors: &mut PerAxis<Errors>,
    ) -> [f32; 3] {
        let AttitudeTracking { error, rates, accelerations, .. } = tracking;
        let track =
            |x1, x2, e1, x1d_dot, x1d_ddot| SubsystemTracking { x1, x2, e1, x1d_dot, x1d_ddot, approach_1_s: None };
        let roll = track(eta.x, eta_dot.x, error.x, rates.x, accelerations.x);
        let pitch = track(eta.y, eta_dot.y, error.y, rates.y, accelerations.y);
        let yaw = track(eta.z, eta_dot.z, error.z, rates.z, accelerations.z);
        [
            self.input(Axis::Roll, roll, context, &mut estimates.roll, &mut errors.roll),
            self.input(Axis::Pitch, pitch, context, &mut estimates.pitch, &mut errors.pitch),
            self.input(Axis::Yaw, yaw, context, &mut estimates.yaw, &mut errors.yaw),
        ]
    }

    /// Returns U1..U3 \[N\] that compensate the observed moments and the drag's moment at this velocity in body axes.
    #[inline(always)]
    fn moment_compensation_n(
        &self,
        observed_rad_s2: &Vector3<f32>,
        velocity_body_m_s: &Vector3<f32>,
        share: f32,
        touches_ground: bool,
    ) -> [f32; 3] {
        let Some(moments) = &self.moments else { return [0.0; 3] };
        // On the ground, the feet also hold the vehicle against the drag.
        let known =
            if touches_ground { Vector3::zeros() } else { self.drag_acceleration_rad_s2(velocity_body_m_s, share) };
        moments.compensating_inputs_n(&(observed_rad_s2 + known))
    }

    /// Returns U1..U4 \[N\] for the mixer, and the effort factor. The inputs are filtered, the moment compensation is
    /// added, and U1..U3 are multiplied by the effort factor.
    #[inline(always)]
    fn commanded_inputs(
        &self,
        filters: &mut FilterMemories,
        [u1, u2, u3, u4]: [f32; 4],
        [roll_n, pitch_n, yaw_n]: [f32; 3],
        hover_n: f32,
        stands: bool,
    ) -> (Inputs, f32) {
        // The compensation of yaw may pass the filter of U3, because that filter has no lead that would amplify the
        // compensation.
        let inputs = Inputs { roll_n: u1, pitch_n: u2, yaw_n: u3 + yaw_n, thrust_n: u4 };
        let mut inputs = self.smoother.advance(&mut filters.smoothed, &inputs);
        let mut effort = 1.0;
        if self.moments.is_some() {
            effort = self.effort.advance(&mut filters.effort_excess, hover_n);
            // The compensation of roll and pitch is added after the filters: it is smooth already, and the observer
            // would feed back the filters' lead.
            let share = filters.moments.as_ref().map_or(1.0, MomentObserverMemory::effectiveness_share);
            let tilt_effort = effort / share;
            inputs.roll_n = (inputs.roll_n + roll_n) * tilt_effort;
            inputs.pitch_n = (inputs.pitch_n + pitch_n) * tilt_effort;
            inputs.yaw_n *= effort;
        }
        // On the ground, moments would increase the thrust and tip over the vehicle.
        let commanded = if stands { Inputs { thrust_n: inputs.thrust_n, ..Inputs::default() } } else { inputs };
        (commanded, effort)
    }
}

impl<L: SubsystemLaw, const N: usize> FlightController<N> for Controller<L, N> {
    type Memory = CascadeMemory<L::Estimate>;

    fn dt_s(&self) -> f32 {
        self.settings.dt_s
    }

    fn mixer(&self) -> &Mixer<N> {
        &self.mixer
    }

    #[inline(always)]
    fn decide(&self, memory: &mut Self::Memory, state: &State, setpoint: &Setpoint, fresh: bool) -> Action<N> {
        self.cascade(memory, state, setpoint, fresh)
    }

    fn on_ground(&self, memory: &mut Self::Memory) {
        memory.filters.standstill.land();
    }

    fn position_lost(&self, memory: &mut Self::Memory) {
        if let Some(forces) = &mut memory.filters.forces {
            forces.hold();
        }
    }

    fn trace(memory: &Self::Memory) -> Trace {
        memory.trace()
    }
}

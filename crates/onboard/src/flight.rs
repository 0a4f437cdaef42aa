//! The control tick of a vehicle: estimator, guidance, flight core and motors.

use crate::configuration::Configuration;
use crate::control_inputs::ControlInputs;
use crate::front_end::{Corrections, EstimatorFrontEnd};
use crate::guided::{Core, GuidanceStage};
use crate::imu_selector::ImuSelector;
use crate::law::FlightLaw;
use crate::readings::Readings;
use crate::sensor_timeouts::SensorTimeouts;
use crate::tick_record::{Report, TickBefore, TickDetails, TickInputs};
use afbc::{AdaptiveEstimate, Guarded};
use afbc_control::Trace;
use afbc_estimator::{Estimator, OutputFilter, VelocityNotch};
use afbc_flight_core::{FlightCore, FlightCoreMemory, Motor};
use afbc_types::{Declared, OutOfRange, PerAxis, ROTORS_MAX};

/// A vehicle under a law: AFBC with its monitor, unless it is simulated or replayed under another one.
#[derive(Clone, Debug)]
pub struct Flight<const N: usize = 4, C: FlightLaw<N> = Guarded<N>> {
    vehicle: FlightCore<C, N>,
    memory: FlightCoreMemory<C::Memory>,
    front_end: EstimatorFrontEnd,
    motor: Motor,
    guidance: GuidanceStage,
    timeouts: SensorTimeouts,
    /// True if the flight core's observer provided the last tick's state.
    observes: bool,
    /// True if the guidance let the armed vehicle idle on the ground in the last tick.
    idle_on_ground: bool,
    saturated_ticks: u32,
}

/// Everything derived from a [`Configuration`], so that [`Flight::adopt`] only has to copy.
#[derive(Clone, Debug)]
pub struct Prepared<const N: usize = 4, C: FlightLaw<N> = Guarded<N>> {
    vehicle: FlightCore<C, N>,
    estimator: Estimator,
    output_filter: OutputFilter,
    corrections: Corrections,
    motor: Motor,
    guidance: GuidanceStage,
}

impl<const N: usize> Prepared<N> {
    /// Prepares a flight.
    ///
    /// # Errors
    /// The first parameter, setting or gain that is out of range or leaves the vehicle without a margin to hover. Also
    /// if there are not `N` rotors.
    pub fn new(configuration: &Configuration) -> Result<Self, OutOfRange> {
        configuration.imu.validate()?;
        configuration.calibration.validate()?;
        Self::around(configuration, configuration.controller()?)
    }
}

impl<const N: usize, C: FlightLaw<N>> Prepared<N, C> {
    /// Prepares a flight under `controller`, which must be built for this vehicle.
    ///
    /// # Errors
    /// The first of the other parameters and settings that is out of range. Also if there are not `N` rotors.
    pub fn under(configuration: &Configuration, controller: C) -> Result<Self, OutOfRange> {
        configuration.imu.validate()?;
        configuration.calibration.validate()?;
        Self::around(configuration, controller)
    }

    /// Adds everything else to a controller. Always inlined: otherwise its result is on the stack of the firmware's
    /// start-up twice.
    #[inline(always)]
    fn around(configuration: &Configuration, controller: C) -> Result<Self, OutOfRange> {
        let Configuration { parameters, curve, response, imu, calibration, estimation, arming, radio, .. } =
            configuration;
        radio.validate()?;
        configuration.rotors.array::<N>()?;
        Ok(Prepared {
            vehicle: FlightCore::with_rotors(*parameters, response, *arming, controller)?,
            estimator: Estimator::new(*estimation)?,
            output_filter: OutputFilter::of(parameters, N).handing_over(),
            corrections: Corrections::new(imu, calibration),
            motor: Motor::new(*curve)?,
            guidance: GuidanceStage::new(configuration)?,
        })
    }
}

impl<const N: usize> Flight<N> {
    /// Creates the vehicle, disarmed.
    ///
    /// # Errors
    /// The errors of [`Prepared::new`].
    pub fn new(configuration: &Configuration) -> Result<Self, OutOfRange> {
        Ok(Self::of(Prepared::new(configuration)?))
    }
}

impl<const N: usize, C: FlightLaw<N>> Flight<N, C> {
    /// Creates the vehicle, disarmed, from a prepared flight.
    // This function is always inlined, so that the vehicle is on the stack of the firmware's start-up only once.
    #[inline(always)]
    pub fn of(prepared: Prepared<N, C>) -> Self {
        let Prepared { vehicle, estimator, output_filter, corrections, motor, guidance } = prepared;
        Flight {
            vehicle,
            memory: FlightCoreMemory::default(),
            front_end: EstimatorFrontEnd::corrected(estimator, output_filter, corrections),
            motor,
            guidance,
            timeouts: SensorTimeouts::default(),
            observes: false,
            idle_on_ground: false,
            saturated_ticks: 0,
        }
    }

    /// Flies with another configuration from the next tick on. The estimate continues, unless the inertial sensor's
    /// mounting or a sensor's calibration changes. While armed, this returns false and does nothing.
    #[must_use = "an armed vehicle keeps its configuration"]
    pub fn adopt(&mut self, prepared: &Prepared<N, C>) -> bool {
        let disarmed = !self.memory.mode().armed();
        if disarmed {
            let Prepared { vehicle, estimator, output_filter, corrections, motor, guidance } = prepared;
            self.vehicle.clone_from(vehicle);
            self.front_end.adopt(estimator, output_filter, corrections);
            self.motor = *motor;
            self.guidance.adopt(guidance);
        }
        disarmed
    }

    /// Changes the law from the next tick on, even while armed. The new law starts as after arming. `prepared` must
    /// have the same configuration. Only for simulators: no firmware image has several laws.
    pub fn change_law(&mut self, prepared: &Prepared<N, C>) {
        self.vehicle.clone_from(&prepared.vehicle);
        self.memory.forget_law();
    }

    /// Returns AFBC's estimates in the present or last flight; none before the first flight or under another law.
    pub fn estimates(&self) -> Option<PerAxis<AdaptiveEstimate>> {
        C::estimates(self.memory.control()?)
    }

    /// Moves the notch filter in the law's velocity, from the next tick on. Call it between ticks. Does nothing if the
    /// vehicle has no notch.
    pub fn move_notch(&mut self, to: &VelocityNotch) {
        self.front_end.move_notch(to);
    }

    /// Returns the notch filter in the law's velocity, if there is one.
    pub fn notch(&self) -> Option<&VelocityNotch> {
        self.front_end.notch()
    }

    /// Records that the clock has failed and another has taken over. The vehicle cannot be armed again.
    pub fn distrust_clock(&mut self) {
        self.memory.distrust_clock();
    }

    /// Returns the law's internal signals in the last tick: only inputs while blind, zeros while disarmed.
    pub fn trace(&self) -> Trace {
        self.memory.trace::<C, N>()
    }

    /// Returns the state before a tick that logs need. `messages` are the inputs that the tick will take.
    pub fn before(&self, messages: &ControlInputs) -> TickBefore {
        let (stands_m, works) = self.front_end.before();
        TickBefore { pose: messages.inbox.pose().copied(), stands_m, works }
    }

    /// Returns the details of the last tick for logs. Call it after the tick, before anything else changes. `inputs`
    /// are the tick's inputs, and `messages` the state in which the tick left its messages.
    pub fn details(&self, inputs: &TickInputs, before: &TickBefore, messages: &ControlInputs) -> TickDetails {
        let front_end = &self.front_end;
        TickDetails {
            inputs: *inputs,
            pose: before.pose,
            sticks: messages.orders.sticks,
            sample: front_end.sample(inputs),
            local: front_end.local(&inputs.readings, before),
            offers: before.works && front_end.senses(),
            on_ground: front_end.is_on_ground(),
            trace: self.trace(),
            estimate: front_end.estimate(inputs.time_us),
            aids: *front_end.memory().aids(),
            origin_m: front_end.origin_m(),
            state: self.memory.state().copied(),
        }
    }

    /// Cross-checks the inertial sensors after the tick that took these readings.
    pub fn cross_check(&self, selector: &mut ImuSelector, readings: &Readings) {
        if let Some(inertial) = self.front_end.inertial() {
            selector.cross_check(&inertial, &self.front_end.other_sensors(readings));
        }
    }

    /// Runs one control tick. Call it every millisecond, with the inputs from messages and the readings of the
    /// vehicle's own sensors. `now_us` is the time since power-up. Cannot fail.
    // This function is always inlined: copying the report out of a call costs a hundred instructions.
    #[inline(always)]
    pub fn tick(&mut self, now_us: u64, inputs: &mut ControlInputs, readings: &Readings) -> Report {
        // Comes before the front end, which removes the pose from the inbox.
        let mut sensors = self.timeouts.tick(now_us, readings, inputs.inbox.pose().is_some());
        // While the observer flies, the inertial sensor counts as failed even if it still sends samples, as a stuck
        // sensor does.
        sensors.inertial |= self.observes;
        let (mode, airborne, rested) = (self.memory.mode(), self.memory.airborne(), self.memory.rested());
        // Uses the last tick's decision, because this tick's decision needs the estimate first.
        self.front_end.set_on_ground(!mode.armed() || self.idle_on_ground && !airborne);
        let estimate = self.front_end.tick(now_us, readings, &mut inputs.inbox);
        let observed = self.memory.state().filter(|_| self.observes);
        let core = Core { mode, airborne, rested, sensors, observed };
        let guided = self.guidance.tick(now_us, inputs, &core);
        self.idle_on_ground = inputs.inbox.idle_on_ground();
        let outcome = self.vehicle.tick(&mut self.memory, now_us, &inputs.inbox);
        self.guidance.gave(outcome.forces.0.iter().sum());
        self.observes = outcome.health.observed;
        if outcome.health.control.saturated {
            self.saturated_ticks = self.saturated_ticks.saturating_add(1);
        }
        let observed = if outcome.health.observed { self.memory.state().copied() } else { None };
        // Report, logs and telemetry have room for the largest number of rotors: from here on, the code is the same for
        // every vehicle.
        let mut throttles = [0; ROTORS_MAX];
        let used = self.motor.throttles(outcome.mode.armed(), &outcome.motors);
        throttles.iter_mut().zip(used).for_each(|(to, from)| *to = from);
        Report {
            time_us: now_us,
            mode: outcome.mode,
            rotors: N as u8,
            motors: outcome.motors.padded(),
            throttles,
            estimate: observed.or(estimate.map(|estimate| estimate.state)),
            health: outcome.health,
            saturated_ticks: self.saturated_ticks,
            norms: self.memory.control().and_then(C::norms),
            shaken: airborne && self.front_end.is_shaken(),
            ignored: self.front_end.ignored(),
            answer: outcome.answer,
            ended: outcome.ended,
            against: outcome.against,
            guided,
        }
    }
}

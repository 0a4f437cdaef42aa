//! The vehicle with its flight core and motors.

use crate::configuration::Configuration;
use crate::control_inputs::ControlInputs;
use crate::front_end::{Corrections, EstimatorFrontEnd};
use crate::guided::{Core, Guide};
use crate::imu_selector::ImuSelector;
use crate::law::FlightLaw;
use crate::readings::Readings;
use crate::sensor_timeouts::SensorTimeouts;
use crate::tick_record::{Report, TickBefore, TickDetails, TickInputs};
use afbc::Guarded;
use afbc_control::Trace;
use afbc_estimator::{Estimator, OutputFilter, VelocityNotch};
use afbc_flight_core::{FlightCore, FlightCoreMemory, Motor};
use afbc_types::{Declared, OutOfRange};

/// A vehicle under a law: AFBC with its monitor, unless it is simulated or replayed under another.
#[derive(Clone, Debug)]
pub struct Flight<const N: usize = 4, C: FlightLaw<N> = Guarded<N>> {
    vehicle: FlightCore<C, N>,
    memory: FlightCoreMemory<C::Memory>,
    front_end: EstimatorFrontEnd,
    motor: Motor,
    guide: Guide,
    timeouts: SensorTimeouts,
    /// True if the state of the last tick was observed.
    observes: bool,
    /// True if an armed vehicle was to rest on the ground in the last tick.
    idle_on_ground: bool,
    saturated_ticks: u32,
}

/// All that follows from a [`Configuration`], so that [`Flight::adopt`] takes a copy's time.
#[derive(Clone, Debug)]
pub struct Prepared<const N: usize = 4, C: FlightLaw<N> = Guarded<N>> {
    vehicle: FlightCore<C, N>,
    estimator: Estimator,
    output_filter: OutputFilter,
    corrections: Corrections,
    motor: Motor,
    guide: Guide,
}

impl<const N: usize> Prepared<N> {
    /// Prepares a flight.
    ///
    /// # Errors
    /// The first parameter, setting or gain out of range, or the first that leaves the vehicle without a margin to
    /// hover.
    pub fn new(configuration: &Configuration<N>) -> Result<Self, OutOfRange> {
        configuration.imu.validate()?;
        configuration.calibration.validate()?;
        Self::around(configuration, configuration.controller()?)
    }
}

impl<const N: usize, C: FlightLaw<N>> Prepared<N, C> {
    /// Prepares a flight under `controller`, which must be built for this vehicle.
    ///
    /// # Errors
    /// The first of the other parameters and settings out of range.
    pub fn under(configuration: &Configuration<N>, controller: C) -> Result<Self, OutOfRange> {
        configuration.imu.validate()?;
        configuration.calibration.validate()?;
        Self::around(configuration, controller)
    }

    /// Puts everything around a controller. Always inline: out of line, its result is on the stack of the firmware's
    /// start-up twice.
    #[inline(always)]
    fn around(configuration: &Configuration<N>, controller: C) -> Result<Self, OutOfRange> {
        let Configuration { airframe, curve, response, imu, calibration, estimation, arming, radio, .. } =
            configuration;
        radio.validate()?;
        let parameters = &airframe.parameters;
        Ok(Prepared {
            vehicle: FlightCore::with_rotors(*parameters, response, *arming, controller)?,
            estimator: Estimator::new(*estimation)?,
            output_filter: OutputFilter::of(parameters, N).handing_over(),
            corrections: Corrections::new(imu, calibration),
            motor: Motor::new(*curve)?,
            guide: Guide::new(configuration)?,
        })
    }
}

/// What makes a flight of a configuration, under a law of its choice.
pub trait Prepare<const N: usize> {
    /// The law.
    type Law: FlightLaw<N>;

    /// Prepares a flight.
    ///
    /// # Errors
    /// The first parameter out of range.
    fn prepare(&self, configuration: &Configuration<N>) -> Result<Prepared<N, Self::Law>, OutOfRange>;
}

/// The firmware's own law.
impl<const N: usize> Prepare<N> for () {
    type Law = Guarded<N>;

    fn prepare(&self, configuration: &Configuration<N>) -> Result<Prepared<N>, OutOfRange> {
        Prepared::new(configuration)
    }
}

impl<const N: usize> Flight<N> {
    /// Creates the vehicle, disarmed.
    ///
    /// # Errors
    /// Those of [`Prepared::new`].
    pub fn new(configuration: &Configuration<N>) -> Result<Self, OutOfRange> {
        Ok(Self::of(Prepared::new(configuration)?))
    }
}

impl<const N: usize, C: FlightLaw<N>> Flight<N, C> {
    /// Creates the vehicle, disarmed, from what is prepared.
    // Always: the firmware's start-up has it on its stack once.
    #[inline(always)]
    pub fn of(prepared: Prepared<N, C>) -> Self {
        let Prepared { vehicle, estimator, output_filter, corrections, motor, guide } = prepared;
        Flight {
            vehicle,
            memory: FlightCoreMemory::default(),
            front_end: EstimatorFrontEnd::corrected(estimator, output_filter, corrections),
            motor,
            guide,
            timeouts: SensorTimeouts::default(),
            observes: false,
            idle_on_ground: false,
            saturated_ticks: 0,
        }
    }

    /// Flies with another configuration from the next tick on; what the estimator knows stays, unless the inertial
    /// sensor is mounted otherwise, or a sensor is corrected otherwise. False, and without effect, while armed.
    #[must_use = "an armed vehicle keeps its configuration"]
    pub fn adopt(&mut self, prepared: &Prepared<N, C>) -> bool {
        let disarmed = !self.memory.mode().armed();
        if disarmed {
            let Prepared { vehicle, estimator, output_filter, corrections, motor, guide } = prepared;
            self.vehicle.clone_from(vehicle);
            self.front_end.adopt(estimator, output_filter, corrections);
            self.motor = *motor;
            self.guide.adopt(guide);
        }
        disarmed
    }

    /// Flies on under another law, from the next tick on, armed or not: it begins afresh, as after arming. `prepared`
    /// is of the same configuration. For simulators: no image has several laws.
    pub fn change_law(&mut self, prepared: &Prepared<N, C>) {
        self.vehicle.clone_from(&prepared.vehicle);
        self.memory.forget_law();
    }

    /// Returns the memory of the law in this or the last flight; none before the first.
    pub fn law_memory(&self) -> Option<&C::Memory> {
        self.memory.control()
    }

    /// Moves the notch in the velocity that the law gets, from the next tick on, beside the tick; nothing if the
    /// vehicle has none.
    pub fn move_notch(&mut self, to: &VelocityNotch) {
        self.front_end.move_notch(to);
    }

    /// Returns the notch in the velocity that the law gets, if there is one.
    pub fn notch(&self) -> Option<&VelocityNotch> {
        self.front_end.notch()
    }

    /// Records that the clock has failed and another has taken over: the vehicle is not armed again.
    pub fn distrust_clock(&mut self) {
        self.memory.distrust_clock();
    }

    /// Returns the law's internal signals of the last tick: only inputs while blind, zeros while disarmed.
    pub fn trace(&self) -> Trace {
        self.memory.trace::<C, N>()
    }

    /// Returns what logs have of the time before the tick that takes these messages.
    pub fn before(&self, messages: &ControlInputs) -> TickBefore {
        let (stands_m, works) = self.front_end.before();
        TickBefore { pose: messages.inbox.pose().copied(), stands_m, works }
    }

    /// Returns what logs have of the last tick beside its report: beside the tick, not in it, and before anything else
    /// changes. The tick had these inputs; `messages` is what it has left of those.
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

    /// Runs one control tick, to be called every millisecond, with what the link brought and the vehicle's own sensors
    /// read; `now_us` is the time since power-up. Cannot fail.
    // Always: copying the report out of a call costs a hundred instructions.
    #[inline(always)]
    pub fn tick(&mut self, now_us: u64, inputs: &mut ControlInputs, readings: &Readings) -> Report<N> {
        // Before the front end, which takes the pose out of the inbox.
        let mut sensors = self.timeouts.tick(now_us, readings, inputs.inbox.pose().is_some());
        // One that repeats itself has failed, too.
        sensors.inertial |= self.observes;
        let (mode, airborne, rested) = (self.memory.mode(), self.memory.airborne(), self.memory.rested());
        // As decided in the last tick: this one's decision needs the estimate first.
        self.front_end.set_on_ground(!mode.armed() || self.idle_on_ground && !airborne);
        let estimate = self.front_end.tick(now_us, readings, &mut inputs.inbox);
        let observed = self.memory.state().filter(|_| self.observes);
        let core = Core { mode, airborne, rested, sensors, observed };
        let guided = self.guide.tick(now_us, inputs, &core);
        self.idle_on_ground = inputs.inbox.idle_on_ground();
        let outcome = self.vehicle.tick(&mut self.memory, now_us, &inputs.inbox);
        self.guide.gave(outcome.forces.0.iter().sum());
        self.observes = outcome.health.observed;
        if outcome.health.control.saturated {
            self.saturated_ticks = self.saturated_ticks.saturating_add(1);
        }
        let observed = if outcome.health.observed { self.memory.state().copied() } else { None };
        Report {
            time_us: now_us,
            mode: outcome.mode,
            motors: outcome.motors,
            throttles: self.motor.throttles(outcome.mode.armed(), &outcome.motors),
            estimate: observed.or(estimate.map(|estimate| estimate.state)),
            health: outcome.health,
            saturated_ticks: self.saturated_ticks,
            norms: self.memory.control().and_then(C::norms),
            shaken: airborne && self.front_end.is_shaken(),
            answer: outcome.answer,
            ended: outcome.ended,
            against: outcome.against,
            guided,
        }
    }
}

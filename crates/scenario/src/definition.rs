//! Defines a scenario: one vehicle, one trajectory, one environment, and the controllers to compare.

use crate::case::Case;
use crate::contender::{Contender, ControllerKind};
use crate::told::{AssumedInstruments, stated};
use crate::trajectory::Trajectory;
use afbc::Profile;
use afbc_estimator::Settings;
use afbc_files::read::FileError;
use afbc_files::read::words::out_of_range;
use afbc_flight_core::ArmingLimits;
use afbc_flight_core::motor::Response;
use afbc_plant::instruments::{ImuModel, InstrumentFault};
use afbc_plant::{
    Deviations, Environment, InstrumentSuite, Motion, Plant, PlantModel, Realism, RotorLayout, Rotors, Sensing,
    SensorFault, SimulatedInstruments, StateSensor,
};
use afbc_types::{Mounting, OutOfRange, Parameters, Range, Rotor};
use afbc_vehicles::{Vehicle, data_sheet};

/// Accepted duration of a flight \[s\].
pub const DURATION: Range = Range::new("duration_s", 0.1, 36_000.0);

/// Accepted initial roll and pitch of a vehicle that the flight core must arm \[rad\].
const ARMING_TILT: Range = Range::new("attitude_rad", -TILT_MAX, TILT_MAX);
const TILT_MAX: f64 = ArmingLimits::TILT_MAX.range.max;

/// Accepted initial roll and pitch of a vehicle with its own estimator, which levels itself at the start \[rad\].
const LEVEL: Range = Range::new("attitude_rad", -0.8, 0.8);

/// An interval without states, since the link is down.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Outage {
    /// Start \[s\].
    pub start_s: f64,
    /// End of the outage \[s\].
    pub end_s: f64,
}

/// Everything that determines a flight. The serde output contains exactly these quantities, without the names and
/// descriptions of files: campaigns are recognised by that output.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Scenario {
    /// Short name, used in file names.
    #[serde(skip)]
    pub name: String,
    /// Description in one line.
    #[serde(skip)]
    pub description: String,
    /// Variant of the paper's experiment; none for other scenarios.
    pub case: Option<Case>,
    /// Duration of the flight \[s\].
    pub duration_s: f64,
    /// Equations of motion.
    pub model: PlantModel,
    /// Nominal parameters, known to the controllers.
    pub vehicle: Parameters<f64>,
    /// Rotors of the vehicle in the order of their numbers: four to eight.
    pub rotors: Vec<Rotor<f64>>,
    /// Vehicle file with everything about this vehicle; none if there is no such file.
    pub vehicle_file: Option<Vehicle>,
    /// True parameters with their changes, gusts and payloads.
    pub environment: Environment,
    /// Effects of rotors, air and ground. The seed in here is not used.
    pub realism: Realism,
    /// Properties of the measurement.
    pub sensing: Sensing,
    /// Faults of the measurement.
    pub sensor_faults: Vec<SensorFault>,
    /// Instruments for the vehicle's estimator; their mounting is in the vehicle's file.
    pub instruments: InstrumentSuite,
    /// Instrument properties that the vehicle's software is told.
    pub told: AssumedInstruments,
    /// Failures of the instruments.
    pub instrument_faults: Vec<InstrumentFault>,
    /// Outages of the link.
    pub outages: Vec<Outage>,
    /// True if the controllers fly inside the flight core, as on board.
    pub flight_core: bool,
    /// Seed of all random effects. The same seed gives the same flight.
    pub seed: u64,
    /// Motion at t = 0.
    pub initial: Motion,
    /// The reference.
    pub trajectory: Trajectory,
    /// Controllers to compare, each in its own flight.
    pub contenders: Vec<Contender>,
}

impl Scenario {
    /// Returns the first contender with a law of this kind.
    pub fn contender(&self, kind: ControllerKind) -> Option<&Contender> {
        self.contenders.iter().find(|contender| contender.kind() == kind)
    }

    /// Returns the same flight on another vehicle. Everything about the vehicle comes from its file: masses, rotors,
    /// battery, drag, ground and the gains of `profile`. The events in flight stay: reference, wind, gusts, faults,
    /// changes, payloads, sensors and outages.
    ///
    /// # Errors
    /// One line on the mistake in the gains of the vehicle's file, or on a value that is out of range for this vehicle.
    pub fn on(self, vehicle: &Vehicle, profile: Profile) -> Result<Self, FileError> {
        let unfit = |error: OutOfRange| {
            FileError::whole(&vehicle.name, format!("{} cannot fly it: {}", self.name, out_of_range(&error)))
        };
        let environment = self.environment.on(vehicle.parameters).map_err(unfit)?;
        let Realism { wind, seed, rotors: Rotors { faults, start, .. }, .. } = self.realism.clone();
        let rotors = Rotors { faults, start, ..vehicle.realism.rotors.clone() };
        let contenders = self.contenders.iter().map(|contender| contender.clone().on(vehicle, profile));
        let scenario = Scenario {
            vehicle: vehicle.parameters,
            rotors: vehicle.rotors.clone(),
            vehicle_file: Some(vehicle.clone()),
            environment,
            realism: Realism { rotors, wind, seed, ..vehicle.realism.clone() },
            contenders: contenders.collect::<Result<_, _>>()?,
            ..self.clone()
        };
        scenario.check().map_err(unfit)?;
        Ok(scenario)
    }

    /// Checks the scenario by building every flight.
    ///
    /// # Errors
    /// The first parameter, gain or setting that is out of range.
    pub fn check(&self) -> Result<(), OutOfRange> {
        self.check_flight_core()?;
        self.check_estimator()?;
        self.contenders.iter().try_for_each(|contender| {
            contender.check(&self.vehicle, &self.rotors)?;
            self.plant(contender.step_s())?;
            self.instruments(contender.step_s())?;
            self.sensors(contender.step_s()).map(drop)
        })
    }

    /// If the flight core is used, checks that it can fly every contender.
    ///
    /// # Errors
    /// The first time step or tilt that is out of range.
    pub fn check_flight_core(&self) -> Result<(), OutOfRange> {
        if !self.flight_core {
            return Ok(());
        }
        ARMING_TILT.check(self.initial.attitude_rad.x)?;
        ARMING_TILT.check(self.initial.attitude_rad.y)?;
        self.contenders
            .iter()
            .try_for_each(|contender| afbc_flight_core::tick::DT.check(contender.settings.common.dt_s))
    }

    /// If the vehicle has an IMU, checks that its estimator can fly the scenario.
    ///
    /// # Errors
    /// The first time step, tilt or gravity that is out of range.
    fn check_estimator(&self) -> Result<(), OutOfRange> {
        if self.instruments.imu.is_none() {
            return Ok(());
        }
        Settings::GRAVITY.range.check(self.vehicle.gravity_m_s2)?;
        LEVEL.check(self.initial.attitude_rad.x)?;
        LEVEL.check(self.initial.attitude_rad.y)?;
        self.contenders
            .iter()
            .try_for_each(|contender| afbc_flight_core::tick::DT.check(contender.settings.common.dt_s))
    }

    /// Returns the time from which the scenario may take measurements away \[s\]: the first fault of a sensor or
    /// instrument, or the first outage. It is 0 if measurements fail at random, and infinite if nothing fails.
    pub fn faulty_from_s(&self) -> f64 {
        // Name every field, so that a new instrument that may fail at random cannot be forgotten here.
        let InstrumentSuite { imu: _, tracker, gnss, barometer: _, magnetometer: _ } = &self.instruments;
        let lost =
            tracker.iter().flat_map(|tracker| [tracker.loss, tracker.freeze]).chain(gnss.iter().map(|it| it.loss));
        if lost.chain(self.sensing.dropouts).any(|dropouts| dropouts.rate_hz > 0.0) {
            return 0.0;
        }
        let sensors = self.sensor_faults.iter().map(|fault| fault.start_s);
        let instruments = self.instrument_faults.iter().map(|fault| fault.start_s);
        let outages = self.outages.iter().map(|outage| outage.start_s);
        sensors.chain(instruments).chain(outages).fold(f64::INFINITY, f64::min)
    }

    /// Returns true if another seed gives another flight: noise, biases, dropouts, turbulence or instruments use the
    /// seed.
    pub fn is_random(&self) -> bool {
        let Sensing { noise, bias, delay_s: _, period_s: _, gyro: _, dropouts } = self.sensing;
        let exact = [noise, bias].iter().all(|spread| *spread == Deviations::default()) && dropouts.is_none();
        !exact || self.realism.wind.turbulence.is_some() || self.instruments != InstrumentSuite::default()
    }

    /// Returns true if rotors, air and ground behave as in the paper's equations.
    pub fn is_ideal(&self) -> bool {
        self.realism == Realism { seed: self.realism.seed, ..Realism::default() }
    }

    /// Returns the vehicle at t = 0 for steps of `step_s`; an ideal plant if no other effects are set.
    ///
    /// # Errors
    /// The first setting that is out of range.
    pub fn plant(&self, step_s: f64) -> Result<Plant, OutOfRange> {
        let environment = self.environment.clone().with_frame(RotorLayout::new(&self.rotors)?);
        if self.is_ideal() {
            return Ok(Plant::new(self.model, self.initial, environment));
        }
        let realism = Realism { seed: self.seed, ..self.realism.clone() };
        Plant::with_realism(self.model, self.initial, environment, &realism, step_s)
    }

    /// Returns the sensors, read every `step_s`; none if they are perfect.
    ///
    /// # Errors
    /// The first setting that is out of range.
    pub fn sensors(&self, step_s: f64) -> Result<Option<StateSensor>, OutOfRange> {
        if self.sensing == Sensing::default() && self.sensor_faults.is_empty() {
            return Ok(None);
        }
        StateSensor::new(&self.sensing, self.seed, step_s).map(Some)
    }

    /// Returns the instrument properties that the vehicle is told before a campaign draws its variations.
    #[must_use]
    pub fn told_before_draws(&self) -> AssumedInstruments {
        match &self.told {
            AssumedInstruments::Stated => AssumedInstruments::Suite(Box::new(self.told())),
            told => told.clone(),
        }
    }

    /// Returns the instrument properties that the vehicle's software is told. The software finds out itself which
    /// instruments exist.
    #[must_use]
    pub fn told(&self) -> InstrumentSuite {
        let there = &self.instruments;
        let told = match &self.told {
            AssumedInstruments::Stated => stated(there, self.vehicle_file.as_ref()),
            AssumedInstruments::Drawn => *there,
            AssumedInstruments::Suite(told) => **told,
        };
        InstrumentSuite {
            imu: there.imu.map(|own| told.imu.unwrap_or(own)),
            tracker: there.tracker.map(|own| told.tracker.unwrap_or(own)),
            gnss: there.gnss.map(|own| told.gnss.unwrap_or(own)),
            barometer: there.barometer.map(|own| told.barometer.unwrap_or(own)),
            magnetometer: there.magnetometer.map(|own| told.magnetometer.unwrap_or(own)),
        }
    }

    /// Returns the estimator's settings: derived from the data sheets of the instruments that the vehicle is told, then
    /// replaced by settings in the vehicle's file.
    #[must_use]
    pub fn estimation(&self, step_s: f64) -> Settings {
        let told = self.told();
        let imu = told.imu.unwrap_or(ImuModel::DEFAULT);
        let settings = data_sheet::settings(&told, &imu, self.rotors.len(), self.vehicle.gravity_m_s2, step_s);
        self.vehicle_file.as_ref().map_or(settings, |vehicle| vehicle.stated_over(settings))
    }

    /// Returns the IMU's mounting from the vehicle's file.
    #[must_use]
    pub fn mounting(&self) -> Mounting<f64> {
        self.vehicle_file.as_ref().map_or(Mounting::DEFAULT, |file| file.imu)
    }

    /// Returns the rotors' response that flight software knows, from the vehicle's file.
    #[must_use]
    pub fn response(&self) -> Response {
        self.vehicle_file.as_ref().map_or(Response::DEFAULT, |file| file.response())
    }

    /// Returns the instruments, read every `step_s`; none if the vehicle has none.
    ///
    /// # Errors
    /// The first setting that is out of range.
    pub fn instruments(&self, step_s: f64) -> Result<Option<SimulatedInstruments>, OutOfRange> {
        if self.instruments == InstrumentSuite::default() {
            return Ok(None);
        }
        let mounting = self.mounting();
        let suite =
            InstrumentSuite { imu: self.instruments.imu.map(|imu| ImuModel { mounting, ..imu }), ..self.instruments };
        SimulatedInstruments::new(&suite, &self.instrument_faults, self.seed, step_s).map(Some)
    }
}

//! Definition of a scenario: one vehicle, one trajectory, one environment, the controllers to compare.

use crate::case::Case;
use crate::contender::{Contender, ControllerKind};
use crate::told::{Told, stated};
use crate::trajectory::Trajectory;
use afbc::Profile;
use afbc_estimator::Settings;
use afbc_files::read::FileError;
use afbc_files::read::words::out_of_range;
use afbc_flight_core::ArmingLimits;
use afbc_flight_core::motor::Response;
use afbc_plant::instruments::{Imu, InstrumentFault};
use afbc_plant::{
    Deviations, Environment, Frame, InstrumentSuite, Instruments, Motion, Plant, PlantModel, Realism, Rotors, Sensing,
    SensorFault, StateSensor,
};
use afbc_types::{Mounting, OutOfRange, Parameters, Range, Rotor};
use afbc_vehicles::{Vehicle, data_sheet};

/// Accepted length of a flight \[s\].
pub const DURATION: Range = Range::new("duration_s", 0.1, 36_000.0);

/// Accepted roll and pitch of a vehicle to be armed by the flight core \[rad\].
const ARMING_TILT: Range = Range::new("attitude_rad", -TILT_MAX, TILT_MAX);
const TILT_MAX: f64 = ArmingLimits::TILT_MAX.range.max;

/// Accepted roll and pitch at the start of a vehicle that estimates its state, which levels itself there \[rad\].
const LEVEL: Range = Range::new("attitude_rad", -0.8, 0.8);

/// An interval in which no state arrives, since the link is down.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Outage {
    /// Start \[s\].
    pub start_s: f64,
    /// End, from which states arrive again \[s\].
    pub end_s: f64,
}

/// Everything that determines a flight. Written by serde, it is what decides one, without names of files and their
/// descriptions: campaigns are recognised by that.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Scenario {
    /// Short name, used in file names.
    #[serde(skip)]
    pub name: String,
    /// Description in one line.
    #[serde(skip)]
    pub description: String,
    /// Variant of the paper's experiment, if it is one.
    pub case: Option<Case>,
    /// Length of the flight \[s\].
    pub duration_s: f64,
    /// Equations of motion.
    pub model: PlantModel,
    /// Nominal parameters, known to the controllers.
    pub vehicle: Parameters<f64>,
    /// Its rotors, in the order of their numbers: four to eight.
    pub rotors: Vec<Rotor<f64>>,
    /// The vehicle file that all of this vehicle comes from, if it comes from one.
    pub vehicle_file: Option<Vehicle>,
    /// True parameters with their changes, gusts and payloads.
    pub environment: Environment,
    /// Effects of rotors, air and ground. Its own seed is not used.
    pub realism: Realism,
    /// Properties of the measurement.
    pub sensing: Sensing,
    /// Faults of the measurement.
    pub sensor_faults: Vec<SensorFault>,
    /// Instruments of the vehicle, for its estimator; their mounting is the vehicle file's.
    pub instruments: InstrumentSuite,
    /// What the vehicle's software is told of them.
    pub told: Told,
    /// Failures of the instruments.
    pub instrument_faults: Vec<InstrumentFault>,
    /// Outages of the link.
    pub outages: Vec<Outage>,
    /// Whether the controllers fly inside the flight core, as on board.
    pub flight_core: bool,
    /// Seed of all random effects. The same seed gives the same flight.
    pub seed: u64,
    /// Motion at t = 0.
    pub initial: Motion,
    /// The reference.
    pub trajectory: Trajectory,
    /// Controllers to compare, each in a flight of its own.
    pub contenders: Vec<Contender>,
}

impl Scenario {
    /// Returns the first contender with a law of this kind.
    pub fn contender(&self, kind: ControllerKind) -> Option<&Contender> {
        self.contenders.iter().find(|contender| contender.kind() == kind)
    }

    /// The same flight on another vehicle: everything about the vehicle comes from its file, masses, rotors, battery,
    /// drag, ground and the gains of `profile`. What happens in flight stays: reference, wind, gusts, faults, changes,
    /// payloads, sensors, outages.
    ///
    /// # Errors
    /// One line on what is wrong with the gains in the vehicle's file, or on what is out of range on this vehicle.
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
    /// The first parameter, gain or setting out of range.
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

    /// Checks, if the flight core is used, whether it can fly every contender.
    ///
    /// # Errors
    /// The first time step or tilt out of range.
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

    /// Checks, if the vehicle has an inertial sensor, whether its estimator can fly it.
    ///
    /// # Errors
    /// The first time step, tilt or gravity out of range.
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

    /// Returns the time from which on the scenario may take measurements away: by the first fault of a sensor or an
    /// instrument, the first outage, or from the start if any fail at random. Infinite if it takes none away \[s\].
    pub fn faulty_from_s(&self) -> f64 {
        // Every field by its name, so that a new instrument that may fail at random is not forgotten here.
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

    /// True if another seed gives another flight: noise, biases, dropouts, turbulence or instruments draw from it.
    pub fn is_random(&self) -> bool {
        let Sensing { noise, bias, delay_s: _, period_s: _, gyro: _, dropouts } = self.sensing;
        let exact = [noise, bias].iter().all(|spread| *spread == Deviations::default()) && dropouts.is_none();
        !exact || self.realism.wind.turbulence.is_some() || self.instruments != InstrumentSuite::default()
    }

    /// True if rotors, air and ground are those of the paper's equations.
    pub fn is_ideal(&self) -> bool {
        self.realism == Realism { seed: self.realism.seed, ..Realism::default() }
    }

    /// Returns the vehicle at t = 0 for steps of `step_s`; an ideal one if no other effects are set.
    ///
    /// # Errors
    /// The first setting out of range.
    pub fn plant(&self, step_s: f64) -> Result<Plant, OutOfRange> {
        let environment = self.environment.clone().with_frame(Frame::new(&self.rotors)?);
        if self.is_ideal() {
            return Ok(Plant::new(self.model, self.initial, environment));
        }
        let realism = Realism { seed: self.seed, ..self.realism.clone() };
        Plant::with_realism(self.model, self.initial, environment, &realism, step_s)
    }

    /// Returns the sensors, read every `step_s`; none if they are perfect.
    ///
    /// # Errors
    /// The first setting out of range.
    pub fn sensors(&self, step_s: f64) -> Result<Option<StateSensor>, OutOfRange> {
        if self.sensing == Sensing::default() && self.sensor_faults.is_empty() {
            return Ok(None);
        }
        StateSensor::new(&self.sensing, self.seed, step_s).map(Some)
    }

    /// Returns what the vehicle is told whatever a campaign draws from here on.
    #[must_use]
    pub fn told_before_draws(&self) -> Told {
        match &self.told {
            Told::Stated => Told::Suite(Box::new(self.told())),
            told => told.clone(),
        }
    }

    /// Returns what the vehicle's software is told of its instruments. Which of them there are, it finds out.
    #[must_use]
    pub fn told(&self) -> InstrumentSuite {
        let there = &self.instruments;
        let told = match &self.told {
            Told::Stated => stated(there, self.vehicle_file.as_ref()),
            Told::Drawn => *there,
            Told::Suite(told) => **told,
        };
        InstrumentSuite {
            imu: there.imu.map(|own| told.imu.unwrap_or(own)),
            tracker: there.tracker.map(|own| told.tracker.unwrap_or(own)),
            gnss: there.gnss.map(|own| told.gnss.unwrap_or(own)),
            barometer: there.barometer.map(|own| told.barometer.unwrap_or(own)),
            magnetometer: there.magnetometer.map(|own| told.magnetometer.unwrap_or(own)),
        }
    }

    /// Returns the estimator's settings: those that the data sheets of the instruments that it is told of ask for, and
    /// what the vehicle's file states instead.
    #[must_use]
    pub fn estimation(&self, step_s: f64) -> Settings {
        let told = self.told();
        let imu = told.imu.unwrap_or(Imu::DEFAULT);
        let settings = data_sheet::settings(&told, &imu, self.rotors.len(), self.vehicle.gravity_m_s2, step_s);
        self.vehicle_file.as_ref().map_or(settings, |vehicle| vehicle.stated_over(settings))
    }

    /// Returns how the inertial sensor is mounted, as the vehicle's file says.
    #[must_use]
    pub fn mounting(&self) -> Mounting<f64> {
        self.vehicle_file.as_ref().map_or(Mounting::DEFAULT, |file| file.imu)
    }

    /// Returns how the rotors respond, as flight software knows it: as the vehicle's file says.
    #[must_use]
    pub fn response(&self) -> Response {
        self.vehicle_file.as_ref().map_or(Response::DEFAULT, |file| file.response())
    }

    /// Returns the instruments, read every `step_s`; none if the vehicle has none.
    ///
    /// # Errors
    /// The first setting out of range.
    pub fn instruments(&self, step_s: f64) -> Result<Option<Instruments>, OutOfRange> {
        if self.instruments == InstrumentSuite::default() {
            return Ok(None);
        }
        let mounting = self.mounting();
        let suite =
            InstrumentSuite { imu: self.instruments.imu.map(|imu| Imu { mounting, ..imu }), ..self.instruments };
        Instruments::new(&suite, &self.instrument_faults, self.seed, step_s).map(Some)
    }
}

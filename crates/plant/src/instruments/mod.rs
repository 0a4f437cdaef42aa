//! Instruments of a real vehicle: inertial sensor, tracker, GNSS receiver, barometer, magnetometer.
//!
//! Each has its own streams of random numbers, so that its readings do not depend on which others there are, nor on
//! each other's settings. All are in `f64`; their frames are those of [`afbc_types`], with north along earth x. Presets
//! of known parts are in [`presets`], failures in [`Failure`].
//!
//! ```
//! use afbc_types::{Parameters, RotorSpeeds};
//! use afbc_plant::instruments::{Imu, TrackerModel};
//! use afbc_plant::{Environment, InstrumentSuite, Instruments, Motion, Plant, PlantModel};
//! use nalgebra::Vector4;
//!
//! let mut suite = InstrumentSuite::default();
//! suite.imu = Some(Imu::ICM_42688_P);
//! suite.tracker = Some(TrackerModel::MOCAP_100);
//! let mut instruments = Instruments::new(&suite, &[], 7, 0.001)?;
//! let mut plant = Plant::new(PlantModel::RigidBody, Motion::default(), Environment::calm(Parameters::PAPER)?);
//! let mut poses = 0;
//! for _ in 0..1000 {
//!     let readings = instruments.measure(&plant.truth());
//!     assert!(readings.imu.is_some_and(|imu| (imu.specific_force_m_s2.z - 9.81).abs() < 1.0));
//!     poses += readings.tracker.len();
//!     plant.step(&RotorSpeeds(Vector4::repeat(199.9)), 0.001);
//! }
//! assert!((98..=100).contains(&poses)); // 100 Hz, the last one on its way
//! # Ok::<(), afbc_types::OutOfRange>(())
//! ```

mod barometer;
mod failure;
mod gnss;
mod imu;
mod low_pass;
mod magnetometer;
mod markov;
mod mounting;
pub mod presets;
mod schedule;
mod tracker;
mod triad;
mod vibration;

pub use barometer::{Barometer, HeightFix};
pub use failure::{Failure, InstrumentFault, limits};
pub use gnss::{Gnss, GnssFix};
pub use imu::{Accelerometer, Gyroscope, Imu, ImuBias, ImuReading};
pub use magnetometer::{FieldFix, Magnetometer};
pub use presets::Preset;
pub use tracker::{TrackerFix, TrackerModel};

use crate::truth::Truth;
use afbc_types::{Declared, OutOfRange};
use alloc::vec::Vec;
use barometer::Pressure;
use failure::Failures;
use gnss::Receiver;
use imu::Inertial;
use magnetometer::Compass;
use tracker::Tracking;

/// The instruments that a vehicle has. The default is none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct InstrumentSuite {
    /// Inertial sensor.
    pub imu: Option<Imu>,
    /// Tracker.
    pub tracker: Option<TrackerModel>,
    /// GNSS receiver.
    pub gnss: Option<Gnss>,
    /// Barometer.
    pub barometer: Option<Barometer>,
    /// Magnetometer.
    pub magnetometer: Option<Magnetometer>,
}

impl InstrumentSuite {
    /// Checks every parameter of every instrument.
    ///
    /// # Errors
    /// The first parameter out of range.
    pub fn validate(&self) -> Result<(), OutOfRange> {
        self.imu.map_or(Ok(()), |imu| imu.validate())?;
        self.tracker.map_or(Ok(()), |tracker| tracker.validate())?;
        self.gnss.map_or(Ok(()), |gnss| gnss.validate())?;
        self.barometer.map_or(Ok(()), |barometer| barometer.validate())?;
        self.magnetometer.map_or(Ok(()), |magnetometer| magnetometer.validate())
    }
}

/// What reaches the vehicle in one step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InstrumentReadings {
    /// Sample of this step; none without a sensor, or from a dead one.
    pub imu: Option<ImuReading>,
    /// Poses that arrive now, in the order of their arrival.
    pub tracker: Vec<TrackerFix>,
    /// Positions and velocities that arrive now.
    pub gnss: Vec<GnssFix>,
    /// Heights that arrive now.
    pub barometer: Vec<HeightFix>,
    /// Fields that arrive now.
    pub magnetometer: Vec<FieldFix>,
}

/// Instruments in simulation.
#[derive(Clone, Debug)]
pub struct Instruments {
    imu: Option<Inertial>,
    tracker: Option<Tracking>,
    gnss: Option<Receiver>,
    barometer: Option<Pressure>,
    magnetometer: Option<Compass>,
    failures: Failures,
}

impl Instruments {
    /// Creates instruments that are read every `step_s`. The seed may be the plant's, since the streams differ.
    ///
    /// # Errors
    /// The first setting out of range.
    pub fn new(
        suite: &InstrumentSuite,
        faults: &[InstrumentFault],
        seed: u64,
        step_s: f64,
    ) -> Result<Self, OutOfRange> {
        suite.validate()?;
        faults.iter().try_for_each(InstrumentFault::validate)?;
        crate::realism::STEP.check(step_s)?;
        Ok(Instruments {
            imu: suite.imu.map(|imu| Inertial::new(&imu, seed, step_s)),
            tracker: suite.tracker.map(|tracker| Tracking::new(&tracker, seed, step_s)),
            gnss: suite.gnss.map(|gnss| Receiver::new(&gnss, seed, step_s)),
            barometer: suite.barometer.map(|barometer| Pressure::new(&barometer, seed, step_s)),
            magnetometer: suite.magnetometer.map(|magnetometer| Compass::new(&magnetometer, seed, step_s)),
            failures: Failures::new(faults, seed),
        })
    }

    /// Measures the vehicle; to be called once per step, the first time before the first step.
    pub fn measure(&mut self, truth: &Truth) -> InstrumentReadings {
        let (failures, height_m) = (&mut self.failures, truth.position_m.z);
        let imu = self.imu.as_mut().and_then(|imu| failures.imu(imu.sample(truth)));
        let tracker = self.tracker.as_mut().map(|it| it.measure(truth, |fix| failures.tracker(truth.time_s, fix)));
        let gnss = self.gnss.as_mut().map(|it| it.measure(truth, |fix| failures.gnss(truth.time_s, fix)));
        let barometer = self.barometer.as_mut().map(|it| it.measure(truth, |fix| failures.barometer(height_m, fix)));
        let magnetometer = self.magnetometer.as_mut().map(|it| it.measure(truth, |fix| failures.magnetometer(fix)));
        InstrumentReadings {
            imu,
            tracker: tracker.unwrap_or_default(),
            gnss: gnss.unwrap_or_default(),
            barometer: barometer.unwrap_or_default(),
            magnetometer: magnetometer.unwrap_or_default(),
        }
    }

    /// Adds a failure to those that there are.
    ///
    /// # Errors
    /// The first number out of range; nothing has changed then.
    pub fn fail(&mut self, fault: InstrumentFault) -> Result<(), OutOfRange> {
        fault.validate()?;
        self.failures.add(fault);
        Ok(())
    }

    /// Ends all failures, also those to come.
    pub fn clear_faults(&mut self) {
        self.failures.end();
    }

    /// Returns the true biases of the inertial sensor, if there is one, against which estimates of them are judged.
    pub fn imu_bias(&self) -> Option<ImuBias> {
        self.imu.as_ref().map(Inertial::bias)
    }
}

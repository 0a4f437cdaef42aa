//! Instruments of a real vehicle: IMU, tracker, GNSS receiver, barometer, magnetometer.
//!
//! Each instrument has its own random streams, so its readings do not depend on the presence or settings of other
//! instruments. All values are `f64`, in the frames of [`afbc_types`] with north along earth x. [`presets`] has known
//! parts, and [`FailureKind`] the failures.
//!
//! ```
//! use afbc_types::{Parameters, RotorSpeeds};
//! use afbc_plant::instruments::{ImuModel, TrackerModel};
//! use afbc_plant::{Environment, InstrumentSuite, Motion, Plant, PlantModel, SimulatedInstruments};
//! use nalgebra::Vector4;
//!
//! let mut suite = InstrumentSuite::default();
//! suite.imu = Some(ImuModel::ICM_42688_P);
//! suite.tracker = Some(TrackerModel::MOCAP_100);
//! let mut instruments = SimulatedInstruments::new(&suite, &[], 7, 0.001)?;
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

pub use barometer::{BarometerModel, BarometerReading};
pub use failure::{FailureKind, InstrumentFault, limits};
pub use gnss::{GnssFix, GnssModel};
pub use imu::{AccelerometerModel, GyroscopeModel, ImuBias, ImuModel, ImuReading};
pub use magnetometer::{MagnetometerModel, MagnetometerReading};
pub use presets::Preset;
pub use tracker::{TrackerFix, TrackerModel};

use crate::truth::Truth;
use afbc_types::{Declared, OutOfRange};
use alloc::vec::Vec;
use barometer::SimulatedBarometer;
use failure::SimulatedFailures;
use gnss::SimulatedGnssReceiver;
use imu::SimulatedImu;
use magnetometer::SimulatedMagnetometer;
use tracker::SimulatedTracker;

/// Instruments of a vehicle. The default has none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct InstrumentSuite {
    /// IMU.
    pub imu: Option<ImuModel>,
    /// Tracker.
    pub tracker: Option<TrackerModel>,
    /// GNSS receiver.
    pub gnss: Option<GnssModel>,
    /// Barometer.
    pub barometer: Option<BarometerModel>,
    /// Magnetometer.
    pub magnetometer: Option<MagnetometerModel>,
}

impl InstrumentSuite {
    /// Checks every parameter of every instrument.
    ///
    /// # Errors
    /// Returns the first parameter that is out of range.
    pub fn validate(&self) -> Result<(), OutOfRange> {
        self.imu.map_or(Ok(()), |imu| imu.validate())?;
        self.tracker.map_or(Ok(()), |tracker| tracker.validate())?;
        self.gnss.map_or(Ok(()), |gnss| gnss.validate())?;
        self.barometer.map_or(Ok(()), |barometer| barometer.validate())?;
        self.magnetometer.map_or(Ok(()), |magnetometer| magnetometer.validate())
    }
}

/// Readings that reach the vehicle in one step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InstrumentReadings {
    /// IMU sample of this step, `None` without an IMU or from a dead one.
    pub imu: Option<ImuReading>,
    /// Poses that arrive in this step, in the order of arrival.
    pub tracker: Vec<TrackerFix>,
    /// GNSS fixes that arrive in this step.
    pub gnss: Vec<GnssFix>,
    /// Heights that arrive in this step.
    pub barometer: Vec<BarometerReading>,
    /// Magnetic fields that arrive in this step.
    pub magnetometer: Vec<MagnetometerReading>,
}

/// Instruments in simulation.
#[derive(Clone, Debug)]
pub struct SimulatedInstruments {
    imu: Option<SimulatedImu>,
    tracker: Option<SimulatedTracker>,
    gnss: Option<SimulatedGnssReceiver>,
    barometer: Option<SimulatedBarometer>,
    magnetometer: Option<SimulatedMagnetometer>,
    failures: SimulatedFailures,
}

impl SimulatedInstruments {
    /// Creates instruments that are read every `step_s`. The seed may be the plant's, because the streams differ.
    ///
    /// # Errors
    /// Returns the first setting that is out of range.
    pub fn new(
        suite: &InstrumentSuite,
        faults: &[InstrumentFault],
        seed: u64,
        step_s: f64,
    ) -> Result<Self, OutOfRange> {
        suite.validate()?;
        faults.iter().try_for_each(InstrumentFault::validate)?;
        crate::realism::STEP.check(step_s)?;
        Ok(SimulatedInstruments {
            imu: suite.imu.map(|imu| SimulatedImu::new(&imu, seed, step_s)),
            tracker: suite.tracker.map(|tracker| SimulatedTracker::new(&tracker, seed, step_s)),
            gnss: suite.gnss.map(|gnss| SimulatedGnssReceiver::new(&gnss, seed, step_s)),
            barometer: suite.barometer.map(|barometer| SimulatedBarometer::new(&barometer, seed, step_s)),
            magnetometer: suite
                .magnetometer
                .map(|magnetometer| SimulatedMagnetometer::new(&magnetometer, seed, step_s)),
            failures: SimulatedFailures::new(faults, seed),
        })
    }

    /// Measures the vehicle. Call it once per step, the first time before the first step.
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

    /// Adds a failure to the present ones.
    ///
    /// # Errors
    /// Returns the first number that is out of range, and changes nothing then.
    pub fn fail(&mut self, fault: InstrumentFault) -> Result<(), OutOfRange> {
        fault.validate()?;
        self.failures.add(fault);
        Ok(())
    }

    /// Ends all failures, including those that have not begun.
    pub fn clear_faults(&mut self) {
        self.failures.end();
    }

    /// Returns the true biases of the IMU, if there is one, for comparison with estimates.
    pub fn imu_bias(&self) -> Option<ImuBias> {
        self.imu.as_ref().map(SimulatedImu::bias)
    }
}

//! The plant with its disturbances and sensors.

use super::estimation::{EstimateErrors, EstimatorView, SimulatedEstimator};
use super::sample::Sample;
use super::sensing::WiredInstruments;
use afbc::AdaptiveEstimate;
use afbc_control::{Action, Trace};
use afbc_flight_core::Refusal;
use afbc_onboard::{Aged, Readings};
use afbc_plant::instruments::ImuBias;
use afbc_plant::{
    EffectsState, InstrumentSuite, Motion, Plant, SensorFaults, SimulatedInstruments, StateMeasurement, StateSensor,
    Truth,
};
use afbc_scenario::trajectory::{Reference, Trajectory};
use afbc_scenario::{Outage, Scenario};
use afbc_types::{OutOfRange, PerAxis, Pose, ROTORS_MAX, RotorSpeeds, State};
use nalgebra::Vector3;

/// Plant, sensors, link and reference of a scenario.
#[derive(Clone)]
pub struct World {
    plant: Plant,
    /// Estimator of a vehicle with an IMU; without one, the vehicle flies on `sensors`.
    estimator: Option<Box<SimulatedEstimator>>,
    /// Sensors for a vehicle that runs its own estimator outside this world.
    wired: Option<Box<WiredInstruments>>,
    sensors: Option<StateSensor>,
    faults: SensorFaults,
    outages: Vec<Outage>,
    trajectory: Trajectory,
    faulty_from_s: f64,
    dt_s: f64,
}

/// The visible part of the world at one time.
#[derive(Clone, Copy, Debug)]
pub struct WorldView {
    /// Time \[s\].
    pub time_s: f64,
    /// True motion.
    pub motion: Motion,
    /// Measurement by the sensors; none if the sensors are perfect.
    pub measurement: Option<StateMeasurement>,
    /// Errors of the vehicle's own estimate; none without instruments.
    pub estimated: Option<EstimateErrors>,
    /// State of rotors, air and ground after the previous step; none for an ideal plant.
    pub telemetry: Option<EffectsState>,
    /// Reference at this time.
    pub reference: Reference,
    /// Newest state that has reached the pilot, held between samples; none in a dropout or an outage.
    pub state: Option<State>,
    /// Estimate of a vehicle whose attitude is valid, but not its position or velocity.
    pub position_lost: Option<State>,
    /// Reason for which the vehicle's own estimate has no valid state; none without instruments.
    pub missing: Option<Refusal>,
    /// Pose from a tracker, for a vehicle whose IMU has failed.
    pub pose: Option<Aged<Pose>>,
    /// True if the state has just arrived.
    pub new: bool,
}

impl World {
    /// Creates the world of `scenario` at t = 0, for steps of `dt_s`.
    ///
    /// # Errors
    /// Returns the first setting of plant or sensors that is out of range.
    pub fn new(scenario: &Scenario, dt_s: f64) -> Result<Self, OutOfRange> {
        let plant = scenario.plant(dt_s)?;
        Ok(World {
            estimator: SimulatedEstimator::new(scenario, dt_s, &plant.truth())?,
            wired: None,
            plant,
            sensors: scenario.sensors(dt_s)?,
            faults: SensorFaults::new(&scenario.sensor_faults),
            outages: scenario.outages.clone(),
            trajectory: scenario.trajectory.clone(),
            faulty_from_s: scenario.faulty_from_s(),
            dt_s,
        })
    }

    /// Creates the world of `scenario` for a vehicle that runs its own estimator. With instruments, the vehicle first
    /// stands at its start for [`STANDS_S`](super::STANDS_S) of looks before t = 0.
    ///
    /// # Errors
    /// Returns the first setting of plant or sensors that is out of range.
    pub fn wired(scenario: &Scenario, dt_s: f64) -> Result<Self, OutOfRange> {
        let wired = WiredInstruments::new(scenario, dt_s)?;
        Ok(World {
            wired,
            // Without instruments, since the world would otherwise run a second estimator.
            ..World::new(&Scenario { instruments: InstrumentSuite::default(), ..scenario.clone() }, dt_s)?
        })
    }

    /// Creates the [wired](Self::wired) world of a vehicle that is released at once. If the scenario has a ground, the
    /// vehicle stands on it by its own weight.
    ///
    /// # Errors
    /// The same as for [`World::wired`].
    pub fn released(scenario: &Scenario, dt_s: f64) -> Result<Self, OutOfRange> {
        let world = World::wired(scenario, dt_s)?;
        Ok(World { wired: world.wired.map(WiredInstruments::at_once), ..world })
    }

    /// Returns the plant.
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// Returns the plant for changing its weather and faults.
    pub fn plant_mut(&mut self) -> &mut Plant {
        &mut self.plant
    }

    /// Returns the instruments of a [wired](Self::wired) world for making them fail.
    pub fn instruments_mut(&mut self) -> Option<&mut SimulatedInstruments> {
        self.wired.as_deref_mut().map(WiredInstruments::instruments_mut)
    }

    /// Returns the true IMU biases in a [wired](Self::wired) world.
    pub fn imu_bias(&self) -> Option<ImuBias> {
        self.wired.as_deref()?.instruments().imu_bias()
    }

    /// Returns the instruments' last readings in a [wired](Self::wired) world.
    pub fn readings(&self) -> Option<&Readings> {
        self.wired.as_deref().map(WiredInstruments::readings)
    }

    /// Returns true if the vehicle of a [wired](Self::wired) world still stands before t = 0.
    pub fn stands(&self) -> bool {
        self.wired.as_deref().is_some_and(WiredInstruments::stands)
    }

    /// Returns the time from which the vehicle may lack measurements \[s\].
    pub(super) fn faulty_from_s(&self) -> f64 {
        self.faulty_from_s
    }

    /// Returns the time step \[s\].
    pub fn dt_s(&self) -> f64 {
        self.dt_s
    }

    /// Measures without moving the vehicle.
    // This function is always inlined: copying a view into and out of calls takes a fifth of the loop's time.
    #[inline(always)]
    pub fn look(&mut self) -> WorldView {
        let time_s = self.plant.time_s();
        let motion = self.plant.motion();
        if let Some(wired) = &mut self.wired {
            wired.look(&self.plant.truth());
        }
        if let Some(estimator) = &mut self.estimator {
            return estimated(estimator, &self.plant, motion, self.trajectory.at(time_s));
        }
        let measurement = match &mut self.sensors {
            None => None,
            // Sensors without faults need no copy of the motion.
            Some(sensors) if self.faults.are_none() => Some(measure(sensors, &motion)),
            Some(sensors) => Some(measure(sensors, &self.faults.seen(&motion, time_s))),
        };
        let state = match &measurement {
            None => Some(motion.measure()),
            Some(measurement) => measurement.fresh.then_some(measurement.state),
        };
        let reference = self.trajectory.at(time_s);
        // The empty list is checked first, since most flights have no outage and then need no call of cold code.
        let lost = !self.outages.is_empty() && is_lost(&self.outages, time_s);
        let telemetry = self.plant.telemetry();
        let new = measurement.is_none_or(|measurement| measurement.new);
        let state = state.filter(|_| !lost);
        WorldView {
            time_s,
            motion,
            measurement,
            estimated: None,
            telemetry,
            reference,
            state,
            position_lost: None,
            missing: None,
            pose: None,
            new,
        }
    }

    /// Measures a vehicle that is held by hand: it has no acceleration, and its sensors feel only the reaction to
    /// gravity.
    pub fn look_held(&mut self) {
        let zero = Vector3::zeros();
        let truth = Truth { acceleration_m_s2: zero, angular_acceleration_rad_s2: zero, ..self.plant.truth() };
        self.wired.iter_mut().for_each(|wired| wired.look(&truth));
    }

    /// Moves the vehicle by one step with the commanded rotor `speeds`.
    #[inline]
    pub fn advance(&mut self, speeds: &RotorSpeeds<ROTORS_MAX>) {
        self.plant.step(speeds, self.dt_s);
    }
}

impl WorldView {
    /// Returns the sample with this view and a pilot's output.
    #[inline(always)]
    pub fn sample<const N: usize>(
        self,
        action: Action<N>,
        trace: Trace,
        estimates: Option<PerAxis<AdaptiveEstimate>>,
    ) -> Sample {
        let WorldView { time_s, motion, measurement, estimated, telemetry, reference, .. } = self;
        let action = action.padded();
        Sample { time_s, motion, measurement, estimated, telemetry, reference, mode: None, action, trace, estimates }
    }
}

/// Returns the view through the vehicle's own estimator.
// The function is not inlined, so that the step of an ideal flight stays short.
#[inline(never)]
fn estimated(estimator: &mut SimulatedEstimator, plant: &Plant, motion: Motion, reference: Reference) -> WorldView {
    let (time_s, telemetry) = (plant.time_s(), plant.telemetry());
    let EstimatorView { state, position_lost, missing, pose, estimated } = *estimator.look(&plant.truth());
    WorldView {
        time_s,
        motion,
        measurement: None,
        estimated: Some(estimated),
        telemetry,
        reference,
        state,
        position_lost,
        missing,
        pose,
        new: true,
    }
}

/// Returns true if a state sent at `time_s` is lost in an outage.
#[cold]
fn is_lost(outages: &[Outage], time_s: f64) -> bool {
    outages.iter().any(|outage| (outage.start_s..outage.end_s).contains(&time_s))
}

/// Measures the motion with the sensors.
// The function is not inlined, so that the step of an ideal flight stays short.
#[inline(never)]
fn measure(sensors: &mut StateSensor, motion: &Motion) -> StateMeasurement {
    sensors.measure(motion)
}

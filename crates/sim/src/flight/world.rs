//! The vehicle as it is, what pushes it, and what is seen of it.

use super::sample::Sample;
use crate::scenario::{Outage, Scenario};
use crate::trajectory::{Reference, Trajectory};
use afbc_control::{Action, Estimate, Trace};
use afbc_plant::{Measurement, Motion, Plant, Sensors, Telemetry};
use afbc_types::{OutOfRange, PerAxis, RotorSpeeds, State};

/// Everything around a pilot: plant, sensors, link and reference of a scenario.
pub struct World {
    plant: Plant,
    sensors: Option<Sensors>,
    outages: Vec<Outage>,
    trajectory: Trajectory,
    dt_s: f64,
}

/// What there is to see at one time.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// \[s\]
    pub time_s: f64,
    /// True motion.
    pub motion: Motion,
    /// What the sensors made of it; none if they are perfect.
    pub measurement: Option<Measurement>,
    /// What rotors, air and ground did in the step before; none of an ideal plant.
    pub telemetry: Option<Telemetry>,
    /// Where the vehicle should be.
    pub reference: Reference,
    /// What reaches the pilot of the motion, if anything new does.
    pub state: Option<State>,
}

impl World {
    /// The world of `scenario` at t = 0, for steps of `dt_s`.
    ///
    /// # Errors
    /// The first setting of plant or sensors out of range.
    pub fn new(scenario: &Scenario, dt_s: f64) -> Result<Self, OutOfRange> {
        Ok(World {
            plant: scenario.plant(dt_s)?,
            sensors: scenario.sensors(dt_s)?,
            outages: scenario.outages.clone(),
            trajectory: scenario.trajectory.clone(),
            dt_s,
        })
    }

    /// Time from step to step \[s\].
    pub fn dt_s(&self) -> f64 {
        self.dt_s
    }

    /// Measures; the vehicle stays where it is.
    // Always: copying a view in and out of calls costs a fifth of the loop.
    #[inline(always)]
    pub fn look(&mut self) -> View {
        let time_s = self.plant.time_s();
        let motion = self.plant.motion();
        let (state, measurement) = match &mut self.sensors {
            None => (Some(motion.measure()), None),
            Some(sensors) => measure(sensors, &motion),
        };
        let reference = self.trajectory.at(time_s);
        let lost = !self.outages.is_empty() && is_lost(&self.outages, time_s);
        let telemetry = self.plant.telemetry();
        View { time_s, motion, measurement, telemetry, reference, state: state.filter(|_| !lost) }
    }

    /// Moves the vehicle by one step with its rotors told to turn at `speeds`.
    #[inline]
    pub fn advance(&mut self, speeds: &RotorSpeeds) {
        self.plant.step(speeds, self.dt_s);
    }
}

impl View {
    /// This view with what a pilot made of it.
    #[inline(always)]
    pub fn sample(self, action: Action, trace: Trace, estimates: PerAxis<Estimate>) -> Sample {
        let View { time_s, motion, measurement, telemetry, reference, .. } = self;
        Sample { time_s, motion, measurement, telemetry, reference, action, trace, estimates }
    }
}

/// True if nothing that is sent at `time_s` arrives.
#[cold]
fn is_lost(outages: &[Outage], time_s: f64) -> bool {
    outages.iter().any(|outage| (outage.start_s..outage.end_s).contains(&time_s))
}

/// What a pilot is given of the motion, if there is anything new.
// Apart, so that the step of an ideal flight stays short.
#[inline(never)]
fn measure(sensors: &mut Sensors, motion: &Motion) -> (Option<State>, Option<Measurement>) {
    let measurement = sensors.measure(motion);
    (Some(measurement.state).filter(|_| measurement.fresh), Some(measurement))
}

//! Lockstep flights: measure, control, observe, move the vehicle, once per step.

use crate::aboard::Aboard;
use crate::contender::{Build, Contender, Law, Monitored, decimal};
use crate::scenario::{Outage, Scenario};
use crate::trajectory::{Reference, Trajectory};
use afbc::Settings;
use afbc_control::{Action, Estimate, FlightController, Screened, Trace};
use afbc_plant::{Measurement, Motion, Plant, Sensors, Telemetry};
use afbc_types::{OutOfRange, PerAxis, State};
use core::f64::consts::FRAC_PI_2;

/// Distance from the reference beyond which a vehicle counts as lost \[m\].
pub const LOST_DISTANCE_M: f64 = 50.0;

/// Everything there is to know at one step.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
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
    /// What the controller decided.
    pub action: Action,
    /// Why.
    pub trace: Trace,
    /// What the law has learnt; zero for one that learns nothing.
    pub estimates: PerAxis<Estimate>,
}

/// Why and when a vehicle was given up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lost {
    /// \[s\]
    pub time_s: f64,
    /// For people.
    pub reason: &'static str,
}

/// One controller flying one vehicle.
pub struct Flight<C: FlightController> {
    controller: C,
    memory: Screened<C::Memory>,
    plant: Plant,
    sensors: Option<Sensors>,
    outages: Vec<Outage>,
    trajectory: Trajectory,
    dt_s: f64,
}

impl<C: FlightController> Flight<C> {
    /// A flight of `scenario` under `controller`.
    ///
    /// # Errors
    /// The first setting of plant or sensors out of range.
    pub fn new(scenario: &Scenario, controller: C) -> Result<Self, OutOfRange> {
        let dt_s = decimal(controller.dt_s());
        Ok(Flight {
            controller,
            memory: Screened::default(),
            plant: scenario.plant(dt_s)?,
            sensors: scenario.sensors(dt_s)?,
            outages: scenario.outages.clone(),
            trajectory: scenario.trajectory.clone(),
            dt_s,
        })
    }

    /// Measures and controls; the vehicle stays where it is.
    // Always: copying a sample in and out of calls costs a fifth of the loop.
    #[inline(always)]
    pub fn control(&mut self) -> Sample {
        let time_s = self.plant.time_s();
        let motion = self.plant.motion();
        let (state, measurement) = match &mut self.sensors {
            None => (Some(motion.measure()), None),
            Some(sensors) => measure(sensors, &motion),
        };
        let reference = self.trajectory.at(time_s);
        let lost = !self.outages.is_empty() && is_lost(&self.outages, time_s);
        let state = state.as_ref().filter(|_| !lost);
        let action = self.controller.step(&mut self.memory, state, &reference.setpoint());
        let Screened { control, .. } = &self.memory;
        let (trace, estimates, telemetry) = (C::trace(control), C::learnt(control), self.plant.telemetry());
        Sample { time_s, motion, measurement, telemetry, reference, action, trace, estimates }
    }

    /// Moves the vehicle by one step under `action`.
    #[inline]
    pub fn advance(&mut self, action: &Action) {
        self.plant.step(&action.speeds, self.dt_s);
    }

    /// Flies to the end or until the vehicle is lost, showing every step from t = 0 to the end.
    fn run(mut self, duration_s: f64, mut observe: impl FnMut(&Sample)) -> Option<Lost> {
        let steps = (duration_s / self.dt_s).round() as u64;
        for step in 0..=steps {
            let sample = self.control();
            observe(&sample);
            if let Some(reason) = lost(&sample) {
                return Some(Lost { time_s: sample.time_s, reason });
            }
            if step < steps {
                self.advance(&sample.action);
            }
        }
        None
    }
}

/// True if nothing that is sent at `time_s` arrives.
#[cold]
fn is_lost(outages: &[Outage], time_s: f64) -> bool {
    outages.iter().any(|outage| (outage.start_s..outage.end_s).contains(&time_s))
}

/// What a controller is given of the motion, if there is anything new.
// Apart, so that the step of an ideal flight stays short.
#[inline(never)]
fn measure(sensors: &mut Sensors, motion: &Motion) -> (Option<State>, Option<Measurement>) {
    let measurement = sensors.measure(motion);
    (Some(measurement.state).filter(|_| measurement.fresh), Some(measurement))
}

/// Flies `scenario` under one contender, showing every step from t = 0 to the end; tells when the vehicle was lost, if it
/// was.
///
/// # Errors
/// The first parameter, gain or setting out of range; nothing has been flown then.
pub fn fly(
    scenario: &Scenario,
    contender: &Contender,
    observe: impl FnMut(&Sample),
) -> Result<Option<Lost>, OutOfRange> {
    let settings = &contender.settings;
    match &contender.law {
        Law::Afbc(gains) => run(scenario, settings, gains, observe),
        Law::Guarded(gains) => run(scenario, settings, &Monitored(gains), observe),
        Law::Backstepping(gains) => run(scenario, settings, gains, observe),
        Law::Pid(gains) => run(scenario, settings, gains, observe),
        Law::Geometric(gains) => run(scenario, settings, gains, observe),
        Law::Indi(gains) => run(scenario, settings, gains, observe),
    }
}

fn run(
    scenario: &Scenario,
    settings: &Settings,
    gains: &impl Build,
    observe: impl FnMut(&Sample),
) -> Result<Option<Lost>, OutOfRange> {
    let vehicle = scenario.vehicle.to_f32();
    let controller = gains.controller(vehicle, *settings)?;
    if scenario.flight_core {
        let aboard = Aboard::new(vehicle, controller)?;
        return Ok(Flight::new(scenario, aboard)?.run(scenario.duration_s, observe));
    }
    Ok(Flight::new(scenario, controller)?.run(scenario.duration_s, observe))
}

/// Why the vehicle counts as lost, if it does. Assumption A3 rules out a tilt of 90 degrees; a vehicle that has come down
/// on its feet is not lost.
pub(crate) fn lost(sample: &Sample) -> Option<&'static str> {
    let eta = &sample.motion.attitude_rad;
    let distance_m = (sample.motion.position_m - sample.reference.position_m).norm();
    let (upright, near) = (eta.x.abs() < FRAC_PI_2 && eta.y.abs() < FRAC_PI_2, distance_m < LOST_DISTANCE_M);
    // A NaN is neither upright nor near.
    match (upright, near) {
        (true, true) => None,
        (false, _) => Some("tilted beyond 90 degrees"),
        (_, false) => Some("more than 50 m from the reference"),
    }
}

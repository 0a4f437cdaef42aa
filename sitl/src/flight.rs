//! Lockstep flights: measure, control, observe, move the vehicle, once per step.

use crate::scenario::{ControllerKind, Scenario};
use crate::trajectory::{Reference, Trajectory};
use afbc::{Adaptive, Backstepping, Cascade, Command, Controller, FlightController, Law, Memory, adaptive};
use airframe::{OutOfRange, PerAxis};
use core::f64::consts::FRAC_PI_2;
use plant::{Motion, Plant};

/// Distance from the reference beyond which a vehicle counts as lost \[m\].
pub const LOST_DISTANCE_M: f64 = 50.0;

/// Everything there is to know at one step.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// \[s\]
    pub time_s: f64,
    /// True motion.
    pub motion: Motion,
    /// Where the vehicle should be.
    pub reference: Reference,
    /// What the controller decided.
    pub command: Command,
    /// What the law has learnt; zero for the baseline.
    pub estimates: PerAxis<adaptive::Estimate>,
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
pub struct Flight<L: Law> {
    controller: Controller<L>,
    memory: Memory<Cascade<L::Estimate>>,
    plant: Plant,
    trajectory: Trajectory,
    dt_s: f64,
}

impl<L: Law> Flight<L> {
    /// A flight of `scenario` under `law`.
    ///
    /// # Errors
    /// The first parameter or setting out of range.
    pub fn new(scenario: &Scenario, law: L) -> Result<Self, OutOfRange> {
        Ok(Flight {
            controller: Controller::new(scenario.vehicle.to_f32(), scenario.settings, law)?,
            memory: Memory::default(),
            plant: Plant::new(scenario.model, scenario.initial, scenario.environment.clone()),
            trajectory: scenario.trajectory.clone(),
            dt_s: step_s(scenario),
        })
    }

    /// Measures and controls; the vehicle stays where it is.
    // Always: copying a sample in and out of calls costs a fifth of the loop.
    #[inline(always)]
    pub fn control(&mut self) -> Sample {
        let time_s = self.plant.time_s();
        let motion = self.plant.motion();
        let reference = self.trajectory.at(time_s);
        let command = self.controller.step(&mut self.memory, &motion.measure(), &reference.setpoint());
        let estimates = &self.memory.control.estimates;
        let estimates = PerAxis::from_fn(|axis| L::learnt(estimates.get(axis)));
        Sample { time_s, motion, reference, command, estimates }
    }

    /// Moves the vehicle by one step under `command`.
    #[inline]
    pub fn advance(&mut self, command: &Command) {
        self.plant.step(&command.speeds, self.dt_s);
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
                self.advance(&sample.command);
            }
        }
        None
    }
}

/// The plant's step \[s\]: the controller's, without the noise that `f32` adds to a decimal.
fn step_s(scenario: &Scenario) -> f64 {
    (f64::from(scenario.settings.dt_s) * 1e7).round() / 1e7
}

/// Flies `scenario` under one law, showing every step from t = 0 to the end; tells when the vehicle was lost, if it was.
///
/// # Errors
/// The first parameter, gain or setting out of range; nothing has been flown then.
pub fn fly(
    scenario: &Scenario,
    kind: ControllerKind,
    observe: impl FnMut(&Sample),
) -> Result<Option<Lost>, OutOfRange> {
    let duration_s = scenario.duration_s;
    Ok(match kind {
        ControllerKind::Afbc => Flight::new(scenario, adaptive_law(scenario)?)?.run(duration_s, observe),
        ControllerKind::Backstepping => Flight::new(scenario, backstepping_law(scenario)?)?.run(duration_s, observe),
    })
}

/// AFBC with the scenario's gains.
///
/// # Errors
/// The first gain out of range.
pub fn adaptive_law(scenario: &Scenario) -> Result<Adaptive, OutOfRange> {
    Adaptive::new(scenario.gains)
}

/// The baseline with the scenario's gains and nominal vehicle.
///
/// # Errors
/// The first gain or parameter out of range.
pub fn backstepping_law(scenario: &Scenario) -> Result<Backstepping, OutOfRange> {
    let gains = PerAxis::from_fn(|axis| scenario.gains.get(axis).backstepping);
    Backstepping::new(&scenario.vehicle.to_f32(), gains)
}

/// Why the vehicle counts as lost, if it does. Assumption A3 rules out a tilt of 90 degrees.
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

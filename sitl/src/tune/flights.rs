//! What gains are judged by.
//!
//! Every flight is that of the built-in scenario `hardware`: rotors that lag by 20 ms, obey a millisecond late and give 3 N
//! each, a noisy state. The first is that scenario itself; each of the others adds one thing that goes wrong.

use crate::scenario::{FileError, Scenario, parse};
use crate::trajectory::{Sine, Trajectory};
use nalgebra::Vector3;
use plant::{Drag, Environment, Motion, ParameterChange, Quantity, Turbulence};
use std::error::Error;

/// When things go wrong \[s\]: as soon as errors count.
const ONSET_S: f64 = 6.0;

/// The flights that gains are searched with.
///
/// # Errors
/// None in fact: a test flies them.
pub fn training() -> Result<Vec<Scenario>, Box<dyn Error>> {
    let eight = |name, change| Flight { trajectory: eight(8.0), change, ..Flight::new(name, 15.0) };
    let mut late = eight("late", None).scenario()?;
    late.realism.rotors.delay_s = 0.004;
    let mut turbulent = Flight::new("turbulence", 20.0).scenario()?;
    turbulent.realism.drag = Some(Drag::PAPER);
    turbulent.realism.wind.turbulence = Some(Turbulence::MODERATE);
    Ok(vec![
        hardware()?,
        Flight { trajectory: step(Vector3::new(0.6, -0.4, 0.3)), ..Flight::new("step", 12.0) }.scenario()?,
        turbulent,
        eight("weak", Some((Quantity::ThrustFactor, 0.6))).scenario()?,
        eight("heavy", Some((Quantity::Mass, 1.3))).scenario()?,
        late,
    ])
}

/// Flights that no gain has seen in its search, to tell whether it has learnt or memorised.
///
/// # Errors
/// None in fact: a test flies them.
pub fn held_out() -> Result<Vec<Scenario>, Box<dyn Error>> {
    let fast = |name, change| Flight { trajectory: eight(6.0), change, ..Flight::new(name, 20.0) };
    let mut delayed = fast("delayed", None).scenario()?;
    delayed.sensing.delay_s = 0.003;
    let mut windy = fast("wind", None).scenario()?;
    windy.realism.drag = Some(Drag::PAPER);
    windy.realism.wind.steady_m_s = Vector3::new(4.0, 2.0, 0.0);
    windy.realism.wind.turbulence = Some(Turbulence::LIGHT);
    Ok(vec![
        Scenario { seed: 1001, ..hardware()? },
        Flight { trajectory: step(Vector3::new(-0.4, 0.8, -0.3)), ..Flight::new("step-back", 12.0) }.scenario()?,
        windy,
        fast("light", Some((Quantity::Mass, 0.8))).scenario()?,
        fast("inert", Some((Quantity::Inertia, 1.75))).scenario()?,
        delayed,
    ])
}

fn hardware() -> Result<Scenario, FileError> {
    parse("built-in hardware", include_str!("../../scenarios/hardware.toml"), "hardware")
}

/// One calm flight of the hardware.
struct Flight {
    name: &'static str,
    duration_s: f64,
    trajectory: Trajectory,
    /// What changes in flight, and by which factor.
    change: Option<(Quantity, f64)>,
}

impl Flight {
    fn new(name: &'static str, duration_s: f64) -> Self {
        let trajectory = Trajectory::Hover { position_m: Vector3::new(0.0, 0.0, 3.0), yaw_rad: 0.0 };
        Flight { name, duration_s, trajectory, change: None }
    }

    fn scenario(self) -> Result<Scenario, Box<dyn Error>> {
        let hardware = hardware()?;
        let change = |(quantity, factor)| ParameterChange { quantity, factor, start_s: ONSET_S, end_s: f64::INFINITY };
        let changes = self.change.into_iter().map(change).collect();
        let environment = Environment::new(*hardware.environment.nominal(), changes, Vec::new())?;
        let start = self.trajectory.at(0.0);
        let mut initial =
            Motion { position_m: start.position_m, velocity_m_s: start.velocity_m_s, ..Motion::default() };
        initial.attitude_rad.z = start.yaw_rad;
        Ok(Scenario {
            name: self.name.into(),
            description: String::new(),
            duration_s: self.duration_s,
            trajectory: self.trajectory,
            environment,
            initial,
            ..hardware
        })
    }
}

fn step(by_m: Vector3<f64>) -> Trajectory {
    let from_m = Vector3::new(0.0, 0.0, 3.0);
    Trajectory::Step { from_m, to_m: from_m + by_m, at_s: ONSET_S, yaw_rad: 0.5 }
}

/// A lying eight, once round in `period_s`.
fn eight(period_s: f64) -> Trajectory {
    let sine = |amplitude_m, period_s| Sine { amplitude_m, period_s, phase_rad: 0.0 };
    let sines = [sine(1.5, period_s), sine(0.75, 0.5 * period_s), sine(0.3, period_s)];
    Trajectory::Lissajous { centre_m: Vector3::new(0.0, 0.0, 3.0), sines, yaw_rad: 0.0 }
}

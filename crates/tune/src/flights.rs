//! Flights in which gains are evaluated.
//!
//! Every flight is based on the built-in scenario `hardware`: rotors with a lag of 20 ms, a delay of 1 ms and at most 3
//! N each, and a noisy state. The first is that scenario itself; each of the others adds one disturbance. The last two
//! are flown on an estimate, with the sensors of the built-in scenarios `mocap` and `outdoor`.

use afbc_plant::instruments::{Barometer, Gnss, Imu, Magnetometer, Tracker};
use afbc_plant::{
    Contact, Drag, Environment, GroundEffect, Gust, GustKind, Motion, ParameterChange, Quantity, Sensing, Suite,
    Turbulence,
};
use afbc_reader::FileError;
use afbc_sim::scenario::{Outage, Scenario, built_in};
use afbc_sim::trajectory::{Sine, Trajectory, Waypoint};
use afbc_types::Axis;
use nalgebra::Vector3;
use std::error::Error;

/// Onset of disturbances \[s\], when errors already count.
const ONSET_S: f64 = 6.0;
/// Time of the reference's step \[s\]: half a second before errors count, so that mainly the settling counts.
const STEP_S: f64 = 4.5;

/// Returns the flights used in the search for gains.
///
/// # Errors
/// None occurs: a test flies them.
pub fn training() -> Result<Vec<Scenario>, Box<dyn Error>> {
    let to = Vector3::new(0.6, -0.4, 1.0);
    let eight = |name, change| TrainingFlight { trajectory: eight(8.0), change, ..TrainingFlight::new(name, 15.0) };
    let mut late = windy(eight("late", None))?;
    late.realism.rotors.delay_s = 0.004;
    let mut turbulent = TrainingFlight::new("turbulence", 20.0).scenario()?;
    turbulent.realism.drag = Some(Drag::PAPER);
    turbulent.realism.wind.turbulence = Some(Turbulence::MODERATE);
    Ok(vec![
        hardware()?,
        TrainingFlight { trajectory: step(to, 1.0), ..TrainingFlight::new("step", 12.0) }.scenario()?,
        turbulent,
        TrainingFlight { change: Some((Quantity::ThrustFactor, 0.6)), ..TrainingFlight::new("weak", 8.0) }
            .scenario()?,
        windy(eight("heavy", Some((Quantity::Mass, 1.3))))?,
        late,
        // An outage at the onset of each gust and parameter change, and during a step.
        Scenario {
            name: "outages".into(),
            duration_s: 45.0,
            ..blind(hardware()?, &[7.45, 14.95, 19.9, 22.45, 29.95, 37.45])
        },
        blind(
            TrainingFlight { trajectory: step(-to, -1.0), ..TrainingFlight::new("blind-step", 12.0) }.scenario()?,
            &[STEP_S + 0.5],
        ),
        landing("landing", 2.0)?,
        upset("upset", 1.0)?,
        course("course", 1.5)?,
        Hardware { state_delay_s: 0.02, ..Hardware::default() }.flight("old", eight("", None))?,
        Hardware { rotor_lag_s: 0.04, ..Hardware::default() }.flight("slow", eight("", None))?,
        Hardware { rate_noise_rad_s: 0.05, ..Hardware::default() }.flight("noisy", eight("", None))?,
        Hardware { tracker: true, state_delay_s: 0.02, ..Hardware::default() }.flight("tracker", eight("", None))?,
        sensed("mocap", eight("", None), |_| {})?,
        sensed("outdoor", eight("", None), |_| {})?,
    ])
}

/// Returns the held-out flights, which are not used in the search, to detect overfitting.
///
/// # Errors
/// None occurs: a test flies them.
pub fn held_out() -> Result<Vec<Scenario>, Box<dyn Error>> {
    let fast = |name, change| TrainingFlight { trajectory: eight(6.0), change, ..TrainingFlight::new(name, 20.0) };
    let mut delayed = windy(fast("delayed", None))?;
    delayed.sensing.delay_s = 0.003;
    let mut wind = fast("wind", None).scenario()?;
    wind.realism.drag = Some(Drag::PAPER);
    wind.realism.wind.steady_m_s = Vector3::new(4.0, 2.0, 0.0);
    wind.realism.wind.turbulence = Some(Turbulence::LIGHT);
    Ok(vec![
        Scenario { seed: 1001, ..hardware()? },
        TrainingFlight {
            trajectory: step(Vector3::new(-0.4, 0.8, -0.3), 1.5),
            ..TrainingFlight::new("step-back", 12.0)
        }
        .scenario()?,
        wind,
        windy(fast("light", Some((Quantity::Mass, 0.8))))?,
        windy(fast("inert", Some((Quantity::Inertia, 1.75))))?,
        delayed,
        blind(fast("outages", Some((Quantity::Mass, 1.15))).scenario()?, &[ONSET_S - 0.05, 8.3, 11.0, 13.7, 16.4]),
        landing("landing-fast", 1.2)?,
        upset("upset-back", -0.8)?,
        course("course-back", -1.2)?,
        Hardware { state_delay_s: 0.012, ..Hardware::default() }.flight("old", fast("", None))?,
        Hardware { rotor_lag_s: 0.01, ..Hardware::default() }.flight("quick", fast("", None))?,
        Hardware { rotor_lag_s: 0.03, rate_noise_rad_s: 0.02, ..Hardware::default() }
            .flight("noisy", fast("", None))?,
        Hardware { tracker: true, state_delay_s: 0.01, rate_noise_rad_s: 0.02, ..Hardware::default() }
            .flight("tracker", fast("", None))?,
        sensed("mocap", fast("", None), |suite| {
            suite.imu = suite.imu.map(|imu| Imu { gyro: Imu::MPU_6000.gyro, ..imu });
            suite.tracker = Some(Tracker { delay_s: 0.03, ..Tracker::MOCAP_100 });
        })?,
        sensed("outdoor", fast("", None), |suite| {
            (suite.barometer, suite.magnetometer) = (Some(Barometer::BMP388), Some(Magnetometer::QMC5883L));
        })?,
    ])
}

/// Returns `scenario` with an outage of the link of 240 ms at each of these times; the flight core coasts through them.
fn blind(scenario: Scenario, starts_s: &[f64]) -> Scenario {
    let outages = starts_s.iter().map(|&start_s| Outage { start_s, end_s: start_s + 0.24 }).collect();
    Scenario { outages, flight_core: true, ..scenario }
}

/// Returns a flight with pushes of at most a tenth of a second, of about `strength` times 2 m/s or 2 rad/s.
fn upset(name: &'static str, strength: f64) -> Result<Scenario, Box<dyn Error>> {
    let pushes = [
        (Axis::Roll, 60.0, 0.03),
        (Axis::X, 20.0, 0.1),
        (Axis::Pitch, 60.0, 0.03),
        (Axis::Z, 20.0, 0.1),
        (Axis::Yaw, 20.0, 0.1),
    ];
    let push = |((axis, size, length_s), k): ((Axis, f64, f64), u32)| {
        let start_s = ONSET_S + 3.0 * f64::from(k);
        Gust { axis, kind: GustKind::Acceleration, size: size * strength, start_s, end_s: start_s + length_s }
    };
    let pushes = pushes.into_iter().zip(0..).map(push).collect();
    let scenario = TrainingFlight::new(name, 20.0).scenario()?;
    let environment = Environment::new(*scenario.environment.nominal(), Vec::new(), pushes)?;
    Ok(Scenario { environment, ..scenario })
}

/// Returns a course with corners in wind, from each to the next in one second.
fn course(name: &'static str, leg_m: f64) -> Result<Scenario, Box<dyn Error>> {
    let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0)];
    let corner = |(k, (x, y)): (u32, (f64, f64))| {
        let (position_m, yaw_rad) = (Vector3::new(x * leg_m, y * leg_m, 3.0), f64::from(k));
        let arrived_s = ONSET_S + 3.0 * f64::from(k);
        [arrived_s, arrived_s + 2.0].map(|time_s| Waypoint { time_s, position_m, yaw_rad })
    };
    let waypoints = (0..).zip(corners).flat_map(corner).collect();
    let mut scenario =
        TrainingFlight { trajectory: Trajectory::Waypoints(waypoints), ..TrainingFlight::new(name, 22.0) }
            .scenario()?;
    scenario.realism.drag = Some(Drag::PAPER);
    scenario.realism.wind.steady_m_s = Vector3::new(4.0, -2.0, 0.0);
    scenario.realism.wind.turbulence = Some(Turbulence::LIGHT);
    Ok(scenario)
}

/// Returns a flight in light wind that lands within `length_s`, stays on the ground for 3 s with the reference slightly
/// below it, and takes off again.
fn landing(name: &'static str, length_s: f64) -> Result<Scenario, Box<dyn Error>> {
    let at = |time_s, height_m| Waypoint { time_s, position_m: Vector3::new(0.0, 0.0, height_m), yaw_rad: 0.0 };
    let down_s = ONSET_S + length_s;
    let waypoints = vec![at(ONSET_S, 1.0), at(down_s, 0.05), at(down_s + 3.0, 0.05), at(down_s + 5.0, 1.0)];
    let mut scenario =
        TrainingFlight { trajectory: Trajectory::Waypoints(waypoints), ..TrainingFlight::new(name, 16.0) }
            .scenario()?;
    scenario.realism.contact = Some(Contact::PAPER);
    scenario.realism.ground_effect = Some(GroundEffect::PAPER);
    scenario.realism.drag = Some(Drag::PAPER);
    scenario.realism.wind.turbulence = Some(Turbulence::LIGHT);
    Ok(scenario)
}

fn hardware() -> Result<Scenario, FileError> {
    read("hardware")
}

/// Returns a built-in scenario.
fn read(name: &str) -> Result<Scenario, FileError> {
    built_in(name).ok_or_else(|| FileError::whole(name, "no such scenario"))?.read()
}

/// Returns `flight` in moderate turbulence.
fn windy(flight: TrainingFlight) -> Result<Scenario, Box<dyn Error>> {
    let mut scenario = flight.scenario()?;
    scenario.realism.drag = Some(Drag::PAPER);
    scenario.realism.wind.turbulence = Some(Turbulence::MODERATE);
    Ok(scenario)
}

/// What differs from the sensors and rotors of `hardware`.
struct Hardware {
    /// Whether states come from a tracker of 100 Hz, and rates from a gyroscope.
    tracker: bool,
    /// Age of every state \[s\].
    state_delay_s: f64,
    /// Standard deviation of the noise of the rates, rad/s.
    rate_noise_rad_s: f64,
    /// Time constant of the rotors \[s\].
    rotor_lag_s: f64,
}

impl Default for Hardware {
    fn default() -> Self {
        Hardware { tracker: false, state_delay_s: 0.0, rate_noise_rad_s: 0.001, rotor_lag_s: 0.02 }
    }
}

impl Hardware {
    /// Returns `flight` in moderate turbulence with these sensors and rotors.
    fn flight(self, name: &'static str, flight: TrainingFlight) -> Result<Scenario, Box<dyn Error>> {
        let mut scenario = windy(TrainingFlight { name, ..flight })?;
        scenario.sensing.delay_s = self.state_delay_s;
        if self.tracker {
            (scenario.sensing.period_s, scenario.sensing.gyro) = (0.01, true);
        }
        scenario.sensing.noise.rates_rad_s = self.rate_noise_rad_s;
        scenario.realism.rotors.time_constant_s = self.rotor_lag_s;
        Ok(scenario)
    }
}

/// Returns `flight` in moderate turbulence on an estimate, with the instruments of the built-in scenario `name` changed
/// by `change`. The slow error of a receiver, which no law can know, is left out: it would hide what a law does.
fn sensed(
    name: &'static str,
    flight: TrainingFlight,
    change: impl FnOnce(&mut Suite),
) -> Result<Scenario, Box<dyn Error>> {
    let mut scenario = windy(TrainingFlight { name, ..flight })?;
    scenario.sensing = Sensing::default();
    scenario.instruments = read(name)?.instruments;
    change(&mut scenario.instruments);
    let steady = |gnss| Gnss { horizontal_m: 0.0, vertical_m: 0.0, ..gnss };
    scenario.instruments.gnss = scenario.instruments.gnss.map(steady);
    Ok(scenario)
}

/// A flight of `hardware` without gusts.
struct TrainingFlight {
    name: &'static str,
    duration_s: f64,
    trajectory: Trajectory,
    /// Quantity that changes at the onset for half of the remaining flight, and its factor.
    change: Option<(Quantity, f64)>,
}

impl TrainingFlight {
    fn new(name: &'static str, duration_s: f64) -> Self {
        let trajectory = Trajectory::Hover { position_m: Vector3::new(0.0, 0.0, 3.0), yaw_rad: 0.0 };
        TrainingFlight { name, duration_s, trajectory, change: None }
    }

    fn scenario(self) -> Result<Scenario, Box<dyn Error>> {
        let hardware = hardware()?;
        let change = |(quantity, factor)| ParameterChange {
            quantity,
            factor,
            start_s: ONSET_S,
            end_s: 0.5 * (ONSET_S + self.duration_s),
        };
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

fn step(by_m: Vector3<f64>, turn_rad: f64) -> Trajectory {
    let from_m = Vector3::new(0.0, 0.0, 3.0);
    Trajectory::Step { from_m, to_m: from_m + by_m, at_s: STEP_S, yaw_rad: 0.5, turn_rad }
}

/// Returns a horizontal figure of eight with the given period.
fn eight(period_s: f64) -> Trajectory {
    let sine = |amplitude_m, period_s| Sine { amplitude_m, period_s, phase_rad: 0.0 };
    let sines = [sine(1.5, period_s), sine(0.75, 0.5 * period_s), sine(0.3, period_s)];
    Trajectory::Lissajous { centre_m: Vector3::new(0.0, 0.0, 3.0), sines, yaw_rad: 0.0 }
}

//! Flights that gains must survive whatever their cost. They show weaknesses that the training flights do not, since
//! those fly the vehicle that the law knows.

use crate::builder::{self, FlightBuilder, TrainingFlight};
use crate::fast;
use crate::scale::VehicleScale;
use afbc::Profile;
use afbc_plant::noise::{Noise, NoiseStream};
use afbc_plant::{Drag, Environment, PlantParameter, PlantParameterChange, Sensing, Turbulence};
use afbc_scenario::contender::{Contender, ControllerKind};
use afbc_scenario::trajectory::{Sine, Trajectory};
use afbc_scenario::{Scenario, built_in};
use afbc_sim::run::FlightResult;
use afbc_types::OutOfRange;
use afbc_vehicles::Vehicle;
use nalgebra::{Vector3, Vector4};
use rayon::prelude::*;
use std::error::Error;

/// Flights of the campaign `robustness` in which some gains of a low cost lose the vehicle or trip the monitor.
const HARD: [u64; 9] = [156, 176, 211, 275, 696, 800, 901, 8555, 9540];
/// Length of these flights \[s\].
const HARD_S: f64 = 10.0;
/// Largest factor of a condition, for a flight that is lost or in which the monitor trips.
pub(crate) const FAILED: f64 = 2.0;
/// Largest root mean square error of x, y, z \[m\] and yaw \[rad\] at which a vehicle counts as under control.
const IN_CONTROL: [f64; 4] = [1.3, 1.3, 1.3, 1.3];

/// No limit on the change of the inputs.
const ANY: Vector4<f64> = Vector4::new(f64::INFINITY, f64::INFINITY, f64::INFINITY, f64::INFINITY);

/// Number of random flights on vehicles other than the paper's. `SEED` is the seed of the first.
const DRAWN: u64 = 6;
const SEED: u64 = 2700;

/// A flight that gains must survive.
#[derive(Clone, Debug)]
pub struct Condition {
    /// Scenario to fly.
    pub scenario: Scenario,
    /// Largest root mean square error of x, y, z \[m\] and yaw \[rad\] from 5 s on.
    pub rmse: Vector4<f64>,
    /// Largest distance from the reference at the end \[m\].
    pub end_m: f64,
    /// Largest mean |change per step| of U1..U4 \[N\].
    pub jumps_n: Vector4<f64>,
    /// True if the condition applies to AFBC only.
    pub of_afbc: bool,
    /// True if the gains are for the paper's vehicle and must be scaled [by rule](Contender::by_rule) to the flight's
    /// vehicle.
    pub by_rule: bool,
}

/// Returns the flights that gains of the paper's vehicle must survive.
///
/// # Errors
/// None in practice, since a test flies these flights.
pub fn conditions() -> Result<Vec<Condition>, Box<dyn Error>> {
    let mut conditions = vec![
        vehicle("crazyflie", "hover", 1.0)?,
        vehicle("crazyflie", "wind", 1.0)?,
        vehicle("crazyflie", "step", 1.5)?,
        vehicle("racer", "step", 1.5)?,
        sampled()?,
        hardware()?,
        tracked("tracker", [0.012, 0.012, 0.012, 0.008], |s| (s.period_s, s.delay_s, s.gyro) = (0.01, 0.02, true))?,
        tracked("noisy", [0.012, 0.012, 0.022, 0.006], |s| s.noise.rates_rad_s = 0.05)?,
        shaken()?,
    ];
    let campaign = afbc_campaign::built_in("robustness").ok_or("no campaign")?.read()?;
    for flight in HARD {
        let name = format!("robustness-{flight}");
        let scenario = Scenario { name, duration_s: HARD_S, ..campaign.flight(flight)? };
        conditions.push(Condition {
            scenario,
            rmse: IN_CONTROL.into(),
            end_m: 1.0,
            jumps_n: ANY,
            of_afbc: false,
            by_rule: false,
        });
    }
    Ok(conditions)
}

/// Returns the flights that gains of `vehicle` must survive. For the paper's vehicle, returns those of [`conditions`].
///
/// # Errors
/// The first number out of range, if the vehicle cannot fly such a flight.
pub fn conditions_on(vehicle: &Vehicle) -> Result<Vec<Condition>, Box<dyn Error>> {
    if builder::is_paper(vehicle) {
        return conditions();
    }
    let builder = FlightBuilder::new(Some(vehicle));
    let VehicleScale { length, time, wind, .. } = builder.scale;
    let condition = |scenario, end_m| Condition {
        scenario,
        rmse: Vector4::from(IN_CONTROL) * length.max(1.0),
        end_m,
        jumps_n: ANY,
        of_afbc: false,
        by_rule: false,
    };
    let built = |name| builder::read(name)?.on(vehicle, Profile::Flight);
    let mut breeze = built("wind")?;
    let air = &mut breeze.realism.wind;
    air.steady_m_s *= wind;
    air.gusts.iter_mut().for_each(|gust| gust.velocity_m_s *= wind);
    air.turbulence = Some(builder.turbulence(Turbulence::LIGHT));
    let mut step = built("step")?;
    step.realism.rotors.time_constant_s *= 1.5;
    (step.realism.rotors.delay_s, step.sensing.delay_s) = (0.004, 0.004);
    let mut sampled = builder.hardware()?;
    sampled.sensing = Sensing { period_s: 0.01, delay_s: 0.01, ..Sensing::DEFAULT };
    (sampled.name, sampled.duration_s, sampled.flight_core) = ("sampled".into(), 12.0, true);
    let near_m = 0.05 * length.max(1.0);
    let mut conditions = vec![
        condition(built("hover")?, near_m),
        condition(breeze, 1.3 * length.max(1.0)),
        condition(step, near_m),
        Condition { rmse: Vector4::repeat(near_m), ..condition(sampled, 2.0 * near_m) },
        condition(fast::lemniscate(&builder, "lemniscate-hard", 2.5, 0.8)?, 1.3 * length.max(1.0)),
    ];
    for index in 0..DRAWN {
        conditions.push(condition(drawn(&builder, index, time)?, length.max(1.0)));
    }
    Ok(conditions)
}

/// Returns a random flight in turbulence on a vehicle that differs from the law's model. The flights resemble the
/// campaign `robustness`, but never ask for more than the rotors can carry.
fn drawn(builder: &FlightBuilder<'_>, index: u64, time: f64) -> Result<Scenario, Box<dyn Error>> {
    let mut noise = Noise::new(SEED + index, NoiseStream::Scenario);
    let mut between = |low: f64, high: f64| low + (high - low) * noise.uniform();
    let scale = &builder.scale;
    // Only one of thrust and mass may be at its worst.
    let thrust = between(scale.thrust(0.6), 1.2);
    let mass = between(0.7, scale.mass(1.3)).min((thrust / scale.thrust(0.6)).max(0.7));
    let changes = [
        (PlantParameter::Mass, mass),
        (PlantParameter::ThrustFactor, thrust),
        (PlantParameter::Inertia, between(0.7, 1.3)),
    ];
    let change = |(quantity, factor)| PlantParameterChange { quantity, factor, start_s: 0.0, end_s: f64::INFINITY };
    let from_m = Vector3::new(0.0, 0.0, 3.0);
    let by_m = Vector3::new(between(-1.0, 1.0), between(-1.0, 1.0), between(-0.5, 0.5)) * scale.length;
    let trajectory = match index % 3 {
        0 => Trajectory::Step { from_m, to_m: from_m + by_m, at_s: 4.0, yaw_rad: 0.0, turn_rad: between(-1.0, 1.0) },
        1 => Trajectory::Circle {
            centre_m: from_m,
            radius_m: 2.0 * scale.length,
            period_s: between(5.0, 10.0) * time,
            yaw_rad: between(-1.0, 1.0),
        },
        _ => Trajectory::Hover { position_m: from_m, yaw_rad: between(-1.0, 1.0) },
    };
    let mut scenario = builder.scenario(TrainingFlight { trajectory, ..TrainingFlight::new("drawn", HARD_S) })?;
    scenario.name = format!("drawn-{index}");
    scenario.seed = SEED + index;
    let changes = changes.into_iter().map(change).collect();
    scenario.environment = Environment::new(*scenario.environment.nominal(), changes, Vec::new())?;
    scenario.realism.wind.turbulence = Some(builder.turbulence(Turbulence::MODERATE));
    scenario.realism.rotors.time_constant_s *= between(0.5, 1.5);
    scenario.sensing.delay_s = between(0.0, 0.004 * time);
    Ok(scenario)
}

/// Returns a built-in scenario on a built-in vehicle whose rotors lag `slower` times as much as the law assumes. If
/// `slower` exceeds 1, commands and states are also delayed.
fn vehicle(vehicle: &str, name: &str, slower: f64) -> Result<Condition, Box<dyn Error>> {
    let vehicle = afbc_vehicles::built_in(vehicle).ok_or("no vehicle")?.read()?;
    let mut scenario = built_in(name).ok_or("no scenario")?.read()?.on(&vehicle, Profile::Flight)?;
    scenario.realism.rotors.time_constant_s *= slower;
    if slower > 1.0 {
        (scenario.realism.rotors.delay_s, scenario.sensing.delay_s) = (0.004, 0.004);
    }
    scenario.name = format!("{}-{name}", vehicle.name);
    // Wind keeps the vehicle away from the reference.
    let end_m = if name == "wind" { 1.3 } else { 0.05 };
    Ok(Condition { scenario, rmse: IN_CONTROL.into(), end_m, jumps_n: ANY, of_afbc: false, by_rule: true })
}

/// Returns `hardware` with 100 states per second that are 10 ms late, without a gyroscope, in the flight core.
fn sampled() -> Result<Condition, Box<dyn Error>> {
    let mut scenario = built_in("hardware").ok_or("no scenario")?.read()?;
    scenario.sensing = Sensing { period_s: 0.01, delay_s: 0.01, ..Sensing::DEFAULT };
    (scenario.name, scenario.duration_s, scenario.flight_core) = ("sampled".into(), 12.0, true);
    Ok(Condition {
        scenario,
        rmse: Vector4::new(0.05, 0.05, 0.05, 0.05),
        end_m: 0.1,
        jumps_n: ANY,
        of_afbc: false,
        by_rule: false,
    })
}

/// Returns a figure of eight, 3 m long, in light turbulence, with the sensing set by `sense`. The inputs U1 to U4 may
/// change by `jumps_n` \[N\] per step.
fn tracked(name: &str, jumps_n: [f64; 4], sense: impl Fn(&mut Sensing)) -> Result<Condition, Box<dyn Error>> {
    let mut scenario = built_in("hardware").ok_or("no scenario")?.read()?;
    let sine = |amplitude_m, period_s| Sine { amplitude_m, period_s, phase_rad: 0.0 };
    scenario.environment = Environment::calm(*scenario.environment.nominal())?;
    scenario.trajectory = Trajectory::Lissajous {
        centre_m: Vector3::new(0.0, 0.0, 3.0),
        sines: [sine(1.5, 8.0), sine(0.75, 4.0), sine(0.3, 8.0)],
        yaw_rad: 0.0,
    };
    let begin = scenario.trajectory.at(0.0);
    (scenario.initial.position_m, scenario.initial.velocity_m_s) = (begin.position_m, begin.velocity_m_s);
    scenario.realism.drag = Some(Drag::PAPER);
    scenario.realism.wind.turbulence = Some(Turbulence::LIGHT);
    (scenario.name, scenario.duration_s, scenario.seed) = (name.into(), 20.0, SEED);
    sense(&mut scenario.sensing);
    let rmse = Vector4::new(0.023, 0.023, 0.02, 0.05);
    Ok(Condition { scenario, rmse, end_m: 0.1, jumps_n: jumps_n.into(), of_afbc: true, by_rule: false })
}

/// Returns `mocap`, flown on the vehicle's own estimate, with twice the usual vibration of the inertial sensor.
fn shaken() -> Result<Condition, Box<dyn Error>> {
    let mut scenario = built_in("mocap").ok_or("no scenario")?.read()?;
    let imu = scenario.instruments.imu.as_mut().ok_or("no inertial sensor")?;
    (imu.gyro.vibration_rad_s, imu.accel.vibration_m_s2) = (0.04, 2.0);
    (scenario.name, scenario.duration_s, scenario.seed) = ("shaken".into(), 12.0, SEED);
    Ok(Condition {
        scenario,
        rmse: IN_CONTROL.into(),
        end_m: 1.0,
        jumps_n: Vector4::new(0.02, 0.02, 0.1, 0.008),
        of_afbc: true,
        by_rule: false,
    })
}

/// Returns `hardware` with limits slightly below those of its test, as a margin for noise.
fn hardware() -> Result<Condition, Box<dyn Error>> {
    let scenario = built_in("hardware").ok_or("no scenario")?.read()?;
    Ok(Condition {
        scenario,
        rmse: Vector4::new(0.00243, 0.00243, 0.00243, 0.00146),
        end_m: 0.1,
        jumps_n: ANY,
        of_afbc: true,
        by_rule: false,
    })
}

impl Condition {
    /// True if the condition applies to this law.
    pub fn is_asked_of(&self, kind: ControllerKind) -> bool {
        !self.of_afbc || kind == ControllerKind::Afbc
    }

    /// Returns the factor on a contender's cost: 1 if it meets the condition, and at most 2.
    ///
    /// # Errors
    /// The first parameter, gain or setting out of range.
    pub fn factor(&self, contender: &Contender) -> Result<f64, OutOfRange> {
        if !self.is_asked_of(contender.kind()) {
            return Ok(1.0);
        }
        let contender = match &self.scenario.vehicle_file {
            Some(vehicle) if self.by_rule => contender.clone().by_rule(vehicle),
            _ => contender.clone(),
        };
        let run = FlightResult::fly(&self.scenario, &fast::free(&self.scenario, &contender), u64::MAX)?;
        if run.lost.is_some() || run.tripped.is_some() {
            return Ok(FAILED);
        }
        let errors = run.metrics.rmse.component_div(&self.rmse).max();
        let jumps = run.metrics.mean_abs_delta_u.component_div(&self.jumps_n).max();
        // Results better than the limits are not rewarded.
        let excess = errors.max(run.metrics.final_error.xyz().norm() / self.end_m).max(jumps).max(1.0);
        Ok((excess * excess * excess).min(FAILED))
    }
}

/// Returns the product of the conditions' factors on a contender's cost: 1 if it meets all of them.
///
/// # Errors
/// The first parameter, gain or setting out of range.
pub fn factor(conditions: &[Condition], contender: &Contender) -> Result<f64, OutOfRange> {
    let factors: Vec<_> =
        conditions.par_iter().map(|condition| condition.factor(contender)).collect::<Result<_, _>>()?;
    Ok(factors.into_iter().product())
}

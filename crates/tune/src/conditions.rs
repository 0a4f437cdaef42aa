//! Flights that gains have to survive, whatever they cost: what the training flights, all on the vehicle that the law
//! was told of, do not show.

use afbc::Profile;
use afbc_plant::Sensing;
use afbc_sim::contender::{Contender, ControllerKind};
use afbc_sim::run::Run;
use afbc_sim::scenario::{Scenario, built_in};
use afbc_types::OutOfRange;
use nalgebra::Vector4;
use rayon::prelude::*;
use std::error::Error;

/// Flights of the campaign `robustness` that some gains of a low cost lose or hand over to the fallback law.
const HARD: [u64; 9] = [156, 176, 211, 275, 696, 800, 901, 8555, 9540];
/// What of such a flight is flown \[s\].
const HARD_S: f64 = 10.0;
/// Largest factor of a condition, that of a flight which is lost or in which the monitor trips.
const FAILED: f64 = 2.0;
/// Largest root mean square error of x, y, z \[m\] and yaw \[rad\] of a vehicle that is in control of itself.
const IN_CONTROL: [f64; 4] = [1.3, 1.3, 1.3, 1.3];

/// A flight that gains have to survive. No other vehicle's gains but those [by rule](Contender::by_rule) are meant.
#[derive(Clone, Debug)]
pub struct Condition {
    /// The flight.
    pub scenario: Scenario,
    /// Largest root mean square error of x, y, z \[m\] and yaw \[rad\] from 5 s on.
    pub rmse: Vector4<f64>,
    /// Largest distance at the end \[m\].
    pub end_m: f64,
    /// Whether it is asked of AFBC only.
    pub of_afbc: bool,
}

/// Returns the flights that gains have to survive.
///
/// # Errors
/// None occurs: a test flies them.
pub fn conditions() -> Result<Vec<Condition>, Box<dyn Error>> {
    let mut conditions = vec![
        vehicle("crazyflie", "hover", 1.0)?,
        vehicle("crazyflie", "wind", 1.0)?,
        vehicle("crazyflie", "step", 1.5)?,
        vehicle("racer", "step", 1.5)?,
        sampled()?,
        hardware()?,
    ];
    let campaign = afbc_campaign::built_in("robustness").ok_or("no campaign")?.read()?;
    for flight in HARD {
        let name = format!("robustness-{flight}");
        let scenario = Scenario { name, duration_s: HARD_S, ..campaign.flight(flight)? };
        conditions.push(Condition { scenario, rmse: IN_CONTROL.into(), end_m: 1.0, of_afbc: false });
    }
    Ok(conditions)
}

/// A built-in scenario on another built-in vehicle, whose rotors lag `slower` times as much as its law is told; if they
/// do, commands and states are late as well.
fn vehicle(vehicle: &str, name: &str, slower: f64) -> Result<Condition, Box<dyn Error>> {
    let vehicle = afbc_vehicles::built_in(vehicle).ok_or("no vehicle")?.read()?;
    let mut scenario = built_in(name).ok_or("no scenario")?.read()?.on(&vehicle, Profile::Flight)?;
    scenario.realism.rotors.time_constant_s *= slower;
    if slower > 1.0 {
        (scenario.realism.rotors.delay_s, scenario.sensing.delay_s) = (0.004, 0.004);
    }
    scenario.name = format!("{}-{name}", vehicle.name);
    // Wind keeps a vehicle off.
    let end_m = if name == "wind" { 1.3 } else { 0.05 };
    Ok(Condition { scenario, rmse: IN_CONTROL.into(), end_m, of_afbc: false })
}

/// `hardware` on 100 states per second that are 10 ms late, without a gyroscope, through the flight core.
fn sampled() -> Result<Condition, Box<dyn Error>> {
    let mut scenario = built_in("hardware").ok_or("no scenario")?.read()?;
    scenario.sensing = Sensing { period_s: 0.01, delay_s: 0.01, ..Sensing::DEFAULT };
    (scenario.name, scenario.duration_s, scenario.flight_core) = ("sampled".into(), 12.0, true);
    Ok(Condition { scenario, rmse: Vector4::new(0.05, 0.05, 0.05, 0.05), end_m: 0.1, of_afbc: false })
}

/// `hardware` within the bounds that its test sets for AFBC, less what noise makes of them.
fn hardware() -> Result<Condition, Box<dyn Error>> {
    let scenario = built_in("hardware").ok_or("no scenario")?.read()?;
    Ok(Condition { scenario, rmse: Vector4::new(0.00243, 0.00243, 0.00243, 0.00146), end_m: 0.1, of_afbc: true })
}

impl Condition {
    /// Returns whether it is asked of this law.
    pub fn is_asked_of(&self, kind: ControllerKind) -> bool {
        !self.of_afbc || kind == ControllerKind::Afbc
    }

    /// Returns by what this flight multiplies the cost of a contender: 1 if it is survived, and at most 2.
    ///
    /// # Errors
    /// The first parameter, gain or setting out of range.
    pub fn factor(&self, contender: &Contender) -> Result<f64, OutOfRange> {
        if !self.is_asked_of(contender.kind()) {
            return Ok(1.0);
        }
        let contender = match &self.scenario.vehicle_file {
            Some(vehicle) => contender.clone().by_rule(vehicle),
            None => contender.clone(),
        };
        let run = Run::fly(&self.scenario, &contender, u64::MAX)?;
        if run.lost.is_some() || run.tripped.is_some() {
            return Ok(FAILED);
        }
        let errors = run.metrics.rmse.component_div(&self.rmse).max();
        let excess = errors.max(run.metrics.final_error.xyz().norm() / self.end_m).max(1.0);
        Ok((excess * excess * excess).min(FAILED))
    }
}

/// Returns by what `conditions` multiply the cost of a contender: 1 if all of them are met.
///
/// # Errors
/// The first parameter, gain or setting out of range.
pub fn factor(conditions: &[Condition], contender: &Contender) -> Result<f64, OutOfRange> {
    let factors: Vec<_> =
        conditions.par_iter().map(|condition| condition.factor(contender)).collect::<Result<_, _>>()?;
    Ok(factors.into_iter().product())
}

//! Weather and faults of one vehicle, changed during the flight.

use crate::command::WorldChange;
use afbc_files::read::words::out_of_range;
use afbc_plant::instruments::InstrumentFault;
use afbc_plant::{
    CosineGust, Environment, Gust, GustKind, InstrumentSuite, Payload, PlantParameterChange, RotorFault, Wind,
};
use afbc_scenario::Scenario;
use afbc_sim::flight::World;
use afbc_types::{Axis, OutOfRange};

/// Largest number of changes of one kind that act at the same time. Each change costs every step a little time.
const ACTIVE_MAX: usize = 256;

/// Weather and faults that act on a vehicle now, and the scenario's weather and faults.
pub(crate) struct WorldChanges {
    suite: InstrumentSuite,
    scenario_wind: Wind,
    scenario_environment: Environment,
    wind: Wind,
    rotors: Vec<RotorFault>,
    /// Instrument failures, by command or by the scenario.
    failures: Vec<InstrumentFault>,
}

impl WorldChanges {
    pub(crate) fn new(scenario: &Scenario) -> Self {
        WorldChanges {
            suite: scenario.instruments,
            scenario_wind: scenario.realism.wind.clone(),
            scenario_environment: scenario.environment.clone(),
            wind: scenario.realism.wind.clone(),
            rotors: scenario.realism.rotors.faults.clone(),
            failures: scenario.instrument_faults.clone(),
        }
    }

    /// Applies `change` to `world` from now on.
    ///
    /// # Errors
    /// Fails with one line; nothing has changed then.
    pub(crate) fn apply(&mut self, change: &WorldChange, world: &mut World) -> Result<(), String> {
        let now_s = world.plant().time_s();
        let until = |seconds: Option<f64>| seconds.map_or(f64::INFINITY, |seconds| now_s + seconds);
        match *change {
            WorldChange::Wind(steady_m_s) => self.set_wind(world, |wind| {
                wind.steady_m_s = steady_m_s;
                Ok(())
            }),
            WorldChange::Turbulence(turbulence) => self.set_wind(world, |wind| {
                wind.turbulence = turbulence;
                Ok(())
            }),
            WorldChange::Gust { velocity_m_s, rise_s, hold_s } => self.set_wind(world, |wind| {
                // Remove gusts that are over: they would pile up in a long session.
                wind.gusts.retain(|gust| gust.start_s + 2.0 * gust.rise_s + gust.hold_s > now_s);
                wind.gusts.push(CosineGust { velocity_m_s, start_s: now_s, rise_s, hold_s });
                bounded(wind.gusts.len())
            }),
            WorldChange::Push { force_n, seconds } => {
                // In the paper a positive gust pushes in the negative direction.
                let sizes = [(Axis::X, -force_n.x), (Axis::Y, -force_n.y), (Axis::Z, -force_n.z)];
                let [start_s, end_s] = [now_s, until(seconds)];
                let gusts = sizes.map(|(axis, size)| Gust { axis, kind: GustKind::Force, size, start_s, end_s });
                load(world, |gusts_now, _, _| gusts_now.extend(gusts.into_iter().filter(|gust| gust.size != 0.0)))
            }
            WorldChange::Change { quantity, factor, seconds } => load(world, |_, changes, _| {
                changes.push(PlantParameterChange { quantity, factor, start_s: now_s, end_s: until(seconds) });
            }),
            WorldChange::Payload { mass_kg, below_m } => load(world, |_, _, payloads| {
                // Keep payloads that the scenario adds later.
                payloads.retain(|payload| payload.start_s > now_s);
                let [ahead_m, left_m] = [0.0; 2];
                let end_s = f64::INFINITY;
                payloads.push(Payload { mass_kg, below_m, ahead_m, left_m, start_s: now_s, end_s });
            }),
            WorldChange::Fault { failure, seconds } => {
                let fault = InstrumentFault { failure, start_s: now_s, end_s: until(seconds), rise_s: 0.0 };
                let (instrument, _) = failure.name().split_once('-').unwrap_or_default();
                let absent = || format!("this vehicle has no {instrument}");
                if !has(&self.suite, instrument) {
                    return Err(absent());
                }
                self.failures.retain(|fault| fault.end_s > now_s);
                bounded(self.failures.len() + 1)?;
                world.instruments_mut().ok_or_else(absent)?.fail(fault).map_err(in_words)?;
                self.failures.push(fault);
                Ok(())
            }
            WorldChange::Rotor { rotor, efficiency } => {
                let mut faults = self.rotors.clone();
                faults.retain(|fault| fault.rotor != rotor);
                faults.push(RotorFault { rotor, efficiency, start_s: now_s });
                world.plant_mut().set_rotor_faults(faults.clone()).map_err(in_words)?;
                self.rotors = faults;
                Ok(())
            }
            WorldChange::Battery(share) => match world.plant_mut().set_charge(share).map_err(in_words)? {
                true => Ok(()),
                false => Err("this vehicle has no battery".into()),
            },
            // The vehicle handles the hand itself.
            WorldChange::Hold(_) => Ok(()),
            WorldChange::Clear => {
                let wind = self.scenario_wind.clone();
                self.set_wind(world, |now| {
                    *now = wind;
                    Ok(())
                })?;
                world.plant_mut().set_rotor_faults(Vec::new()).map_err(in_words)?;
                world.plant_mut().set_environment(self.scenario_environment.clone());
                world.instruments_mut().into_iter().for_each(|instruments| instruments.clear_faults());
                self.rotors.clear();
                self.failures.clear();
                Ok(())
            }
        }
    }

    /// Changes the wind.
    fn set_wind(
        &mut self,
        world: &mut World,
        change: impl FnOnce(&mut Wind) -> Result<(), String>,
    ) -> Result<(), String> {
        let mut wind = self.wind.clone();
        change(&mut wind)?;
        world.plant_mut().set_wind(&wind).map_err(in_words)?;
        self.wind = wind;
        Ok(())
    }

    /// Returns the remaining share of each rotor's thrust at `now_s`.
    pub(crate) fn rotor_shares(&self, rotors: usize, now_s: f64) -> Vec<f64> {
        let of = |rotor: usize| {
            let faults = self.rotors.iter().filter(|fault| usize::from(fault.rotor) == rotor && fault.start_s <= now_s);
            faults.map(|fault| fault.efficiency).product()
        };
        (1..=rotors).map(of).collect()
    }

    /// Returns the faults that act at `now_s`, in words.
    pub(crate) fn active_faults(&self, now_s: f64) -> Vec<String> {
        let failures = self.failures.iter().filter(|fault| (fault.start_s..fault.end_s).contains(&now_s));
        let rotors = self.rotors.iter().filter(|fault| fault.start_s <= now_s && fault.efficiency < 1.0);
        failures
            .map(|fault| fault.failure.name().to_owned())
            .chain(rotors.map(|fault| format!("rotor {} at {}", fault.rotor, fault.efficiency)))
            .collect()
    }
}

/// Changes gusts, parameter changes and payloads; removes those that are over.
fn load(
    world: &mut World,
    change: impl FnOnce(&mut Vec<Gust>, &mut Vec<PlantParameterChange>, &mut Vec<Payload>),
) -> Result<(), String> {
    let now_s = world.plant().time_s();
    let old = world.plant().environment();
    let mut gusts: Vec<Gust> = old.gusts().iter().filter(|gust| gust.end_s > now_s).copied().collect();
    let mut changes: Vec<PlantParameterChange> = old.changes().iter().filter(|it| it.end_s > now_s).copied().collect();
    let mut payloads = old.payloads().to_vec();
    change(&mut gusts, &mut changes, &mut payloads);
    bounded(gusts.len().max(changes.len()))?;
    let new = Environment::new(*old.nominal(), changes, gusts).and_then(|new| new.with_payloads(payloads));
    world.plant_mut().set_environment(new.map_err(in_words)?);
    Ok(())
}

/// Refuses more changes of one kind than may act at the same time.
fn bounded(count: usize) -> Result<(), String> {
    let most = format!("{ACTIVE_MAX} changes of this kind act already; `clear` ends them");
    if count <= ACTIVE_MAX { Ok(()) } else { Err(most) }
}

fn has(suite: &InstrumentSuite, instrument: &str) -> bool {
    match instrument {
        "imu" => suite.imu.is_some(),
        "tracker" => suite.tracker.is_some(),
        "gnss" => suite.gnss.is_some(),
        "barometer" => suite.barometer.is_some(),
        _ => suite.magnetometer.is_some(),
    }
}

fn in_words(error: OutOfRange) -> String {
    out_of_range(&error)
}

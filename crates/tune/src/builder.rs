//! Builds flights from the scenario `hardware` and a vehicle's data.

use crate::scale::VehicleScale;
use afbc::Profile;
use afbc_files::read::FileError;
use afbc_plant::{Drag, Environment, Gust, Motion, PlantParameter, PlantParameterChange, Turbulence};
use afbc_scenario::trajectory::Trajectory;
use afbc_scenario::{Scenario, built_in};
use afbc_types::Axis;
use afbc_vehicles::Vehicle;
use nalgebra::Vector3;
use std::error::Error;

/// Time at which disturbances begin, after errors have begun to count \[s\].
pub(crate) const ONSET_S: f64 = 6.0;

/// True if `vehicle` has the data of the paper's vehicle, with any gains. Its flights are then those made without a
/// vehicle file.
pub fn is_paper(vehicle: &Vehicle) -> bool {
    let paper = afbc_vehicles::built_in("paper").and_then(|paper| paper.read().ok());
    paper.is_some_and(|paper| {
        let of = |of: &Vehicle| (of.parameters, of.rotors.clone(), of.force_max_n, of.realism.clone());
        of(&paper) == of(vehicle)
    })
}

/// Builder of the flights of one vehicle.
pub(crate) struct FlightBuilder<'a> {
    /// Vehicle from a file; none for the paper's vehicle with the rotors of `hardware`.
    pub(crate) vehicle: Option<&'a Vehicle>,
    pub(crate) scale: VehicleScale,
}

impl<'a> FlightBuilder<'a> {
    pub(crate) fn new(vehicle: Option<&'a Vehicle>) -> Self {
        let vehicle = vehicle.filter(|vehicle| !is_paper(vehicle));
        FlightBuilder { vehicle, scale: VehicleScale::of(vehicle) }
    }

    /// Returns `hardware` with gusts and losses of thrust scaled to the vehicle.
    pub(crate) fn hardware(&self) -> Result<Scenario, Box<dyn Error>> {
        let scenario = self.base()?;
        if self.vehicle.is_none() {
            return Ok(scenario);
        }
        let VehicleScale { acceleration, time, .. } = self.scale;
        let gust = |gust: &Gust| {
            let turns = matches!(gust.axis, Axis::Roll | Axis::Pitch | Axis::Yaw);
            // Angles do not scale but times do, so angular accelerations scale with the inverse square of time.
            Gust { size: gust.size * if turns { 1.0 / (time * time) } else { acceleration }, ..*gust }
        };
        let gusts = scenario.environment.gusts().iter().map(gust).collect();
        let change = |change: &PlantParameterChange| match change.quantity {
            PlantParameter::ThrustFactor => {
                PlantParameterChange { factor: self.scale.thrust(change.factor), ..*change }
            }
            _ => *change,
        };
        let changes = scenario.environment.changes().iter().map(change).collect();
        let environment = Environment::new(*scenario.environment.nominal(), changes, gusts)?;
        Ok(Scenario { environment, ..scenario })
    }

    /// Returns `hardware` on the vehicle. The rotors' delay is at least that of `hardware`.
    fn base(&self) -> Result<Scenario, FileError> {
        let scenario = read("hardware")?;
        let Some(vehicle) = self.vehicle else { return Ok(scenario) };
        let delay_s = scenario.realism.rotors.delay_s;
        let mut scenario = scenario.on(vehicle, Profile::Flight)?;
        scenario.realism.rotors.delay_s = scenario.realism.rotors.delay_s.max(delay_s);
        Ok(scenario)
    }

    /// Gives the paper's vehicle its drag. Other vehicles have theirs from their files.
    pub(crate) fn drag(&self, scenario: &mut Scenario) {
        if self.vehicle.is_none() {
            scenario.realism.drag = Some(Drag::PAPER);
        }
    }

    pub(crate) fn turbulence(&self, of: Turbulence) -> Turbulence {
        Turbulence { wind_20ft_m_s: of.wind_20ft_m_s * self.scale.wind, ..of }
    }

    pub(crate) fn scenario(&self, flight: TrainingFlight) -> Result<Scenario, Box<dyn Error>> {
        let base = self.base()?;
        let change = |(quantity, factor)| PlantParameterChange {
            quantity,
            factor,
            start_s: ONSET_S,
            end_s: 0.5 * (ONSET_S + flight.duration_s),
        };
        let changes = flight.change.into_iter().map(change).collect();
        let environment = Environment::new(*base.environment.nominal(), changes, Vec::new())?;
        let start = flight.trajectory.at(0.0);
        let mut initial =
            Motion { position_m: start.position_m, velocity_m_s: start.velocity_m_s, ..Motion::default() };
        initial.attitude_rad.z = start.yaw_rad;
        Ok(Scenario {
            name: flight.name.into(),
            description: String::new(),
            duration_s: flight.duration_s,
            trajectory: flight.trajectory,
            environment,
            initial,
            ..base
        })
    }
}

/// Returns a built-in scenario.
pub(crate) fn read(name: &str) -> Result<Scenario, FileError> {
    built_in(name).ok_or_else(|| FileError::whole(name, "no such scenario"))?.read()
}

/// Description of a flight based on `hardware` without gusts.
pub(crate) struct TrainingFlight {
    pub(crate) name: &'static str,
    pub(crate) duration_s: f64,
    pub(crate) trajectory: Trajectory,
    /// Quantity that changes at the onset for half of the remaining flight, with its factor.
    pub(crate) change: Option<(PlantParameter, f64)>,
}

impl TrainingFlight {
    pub(crate) fn new(name: &'static str, duration_s: f64) -> Self {
        let trajectory = Trajectory::Hover { position_m: Vector3::new(0.0, 0.0, 3.0), yaw_rad: 0.0 };
        TrainingFlight { name, duration_s, trajectory, change: None }
    }
}

//! `--vehicle` and `sitl vehicles`: selects and lists vehicles.

use super::target::TargetArg;
use super::terminal::{CommandError, print};
use afbc::Profile;
use afbc_campaign::Campaign;
use afbc_files::read::words::out_of_range;
use afbc_files::read::{BuiltIn, FileError};
use afbc_scenario::{Scenario, vehicle_named};
use afbc_vehicles::{BUILT_IN, Vehicle, built_in, unknown};
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;

/// Vehicle option of every command that flies.
#[derive(Args, Clone, Debug)]
pub(crate) struct VehicleArgs {
    /// Fly this vehicle, with its gains of the profile `flight`, instead of the scenario's: name of a built-in vehicle,
    /// or path of a vehicle file
    #[arg(long, value_name = "VEHICLE")]
    vehicle: Option<PathBuf>,
}

impl VehicleArgs {
    /// Returns the requested vehicle, checked.
    pub(crate) fn vehicle(&self) -> Result<Option<Vehicle>, CommandError> {
        Ok(self.vehicle.as_deref().map(vehicle_named).transpose()?)
    }

    /// Returns the scenario on the requested vehicle, or unchanged.
    pub(crate) fn put(&self, scenario: Scenario) -> Result<Scenario, CommandError> {
        match self.vehicle()? {
            Some(vehicle) => Ok(scenario.on(&vehicle, Profile::Flight)?),
            None => Ok(scenario),
        }
    }

    /// Returns the campaign on the requested vehicle, or unchanged.
    pub(crate) fn campaign(&self, campaign: Campaign) -> Result<Campaign, CommandError> {
        if self.vehicle.is_none() {
            return Ok(campaign);
        }
        let campaign = Campaign { scenario: self.put(campaign.scenario)?, ..campaign };
        campaign.check().map_err(|error| format!("{}: {}; narrow its spread", campaign.name, out_of_range(&error)))?;
        Ok(campaign)
    }

    /// Returns the vehicle as the firmware's build script expects it: the name of a built-in vehicle, or an absolute
    /// path.
    pub(crate) fn for_firmware(&self) -> Result<Option<PathBuf>, CommandError> {
        let Some(path) = &self.vehicle else { return Ok(None) };
        let known = path.to_str().is_some_and(|name| built_in(name).is_some());
        // The path is absolute, since the build script runs in its package's folder.
        Ok(Some(if known { path.clone() } else { std::path::absolute(path)? }))
    }

    /// Returns the arguments that select `target` and this vehicle.
    pub(crate) fn arguments(&self, target: &TargetArg) -> String {
        self.vehicle.as_ref().map_or(target.to_string(), |path| format!("{target} --vehicle {}", path.display()))
    }
}

/// List the built-in vehicles, or print one of them to start from
///
/// `sitl vehicles racer > my.toml` makes a vehicle file to change and to fly with `sitl fly hover --vehicle my.toml`.
/// See docs/vehicles.md.
#[derive(Args, Debug)]
pub(crate) struct VehiclesArgs {
    /// Built-in vehicle to print
    name: Option<String>,
}

impl VehiclesArgs {
    /// Prints the list or the file.
    pub(super) fn run(self) -> Result<ExitCode, CommandError> {
        match self.name {
            Some(name) => print(built_in(&name).ok_or_else(|| FileError::whole(&name, unknown(&name)))?.text)?,
            None => {
                let all = BUILT_IN.iter().map(BuiltIn::read).collect::<Result<Vec<_>, _>>()?;
                print(&all.iter().map(line).collect::<String>())?;
            }
        }
        Ok(ExitCode::SUCCESS)
    }
}

fn line(Vehicle { name, description, rotors, .. }: &Vehicle) -> String {
    format!("{name:<12}{} rotors  {description}\n", rotors.len())
}

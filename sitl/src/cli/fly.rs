//! `sitl fly`: flies one scenario, or a plan of a ground station.

use super::firmware_flight::{FirmwareLogs, LogOutputs, firmware_flight};
use super::flight_args::{FlightArgs, report};
use super::json::JsonArgs;
use super::mcap::FlightMcap;
use super::output_folder::OutputFolderArgs;
use super::plan::PlanFlight;
use super::target::{TargetArg, is_plan};
use super::terminal::{CommandError, say};
use super::vehicle::VehicleArgs;
use afbc_scenario::Scenario;
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;

/// Fly a built-in scenario or a scenario file; exits with 1 if a vehicle is lost
///
/// A plan of QGroundControl, a file that ends in `.plan`, flies as in `sitl serve`: the firmware's own code flies the
/// mission, geofence and rally points outdoors in a breeze, from the planned home on, for an hour at most. Only the
/// options --vehicle, --duration, --exact-log, --ulog and --mcap apply to a plan. Exits with 1 if the mission is not
/// completed.
#[derive(Args, Debug)]
pub(crate) struct FlyArgs {
    /// Name of a built-in scenario, or path of a scenario file or of a plan
    scenario: TargetArg,

    /// Fly only this law or contender; may be given more than once. A law that the scenario lacks flies with its
    /// default gains
    #[arg(long = "controller", value_name = "NAME")]
    controllers: Vec<String>,

    /// Also fly the scenario with the firmware's own code, as in `sitl pil`, with the first of the controllers, and
    /// write the exact log of that flight to this new file, for `sitl replay --exact`
    #[arg(long, value_name = "FILE")]
    exact_log: Option<PathBuf>,

    /// Also fly the scenario with the firmware's own code, and write the black box of that flight to this new file:
    /// PX4's ULog, for PX4's tools and `sitl replay`
    #[arg(long, value_name = "FILE")]
    ulog: Option<PathBuf>,

    /// Also fly the scenario with the firmware's own code, and write the black box to this new file as MCAP, for
    /// Foxglove, PlotJuggler and ROS 2's tools
    #[arg(long, value_name = "FILE")]
    mcap: Option<PathBuf>,

    /// Seed of weather, noise and faults, instead of the scenario's
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(0..=1_000_000_000))]
    seed: Option<u64>,

    #[command(flatten)]
    on: VehicleArgs,

    #[command(flatten)]
    flying: FlightArgs,

    #[command(flatten)]
    place: OutputFolderArgs,

    #[command(flatten)]
    json: JsonArgs,
}

impl FlyArgs {
    /// Flies, writes the results and prints a table.
    pub(super) fn run(mut self) -> Result<ExitCode, CommandError> {
        if is_plan(self.scenario.path()) {
            return self.fly_plan();
        }
        let mut scenario = self.scenario.scenario()?;
        if !self.controllers.is_empty() {
            scenario.choose(&self.controllers)?;
        }
        let scenario = self.on.put(scenario)?;
        let scenario = Scenario { seed: self.seed.unwrap_or(scenario.seed), ..scenario };
        let name = scenario.name.clone();
        let is_logged = self.mcap.is_some() || self.exact_log.is_some() || self.ulog.is_some();
        let firmware = is_logged.then(|| firmware_flight(&scenario, self.flying.duration)).transpose()?;
        // The files are checked before the flights, so that a file that cannot be written costs no flight. They are
        // created once everything else is right.
        let mcap = FlightMcap::plan(self.mcap, &mut self.ulog)?;
        let outputs = LogOutputs::new(self.exact_log.as_deref(), self.ulog.as_deref())?;
        let mut logs = None;
        let open = || {
            let folder = self.place.open(&name)?;
            logs = Some(FirmwareLogs::create(&outputs)?);
            Ok(folder)
        };
        let (folder, flown) = self.flying.fly(vec![scenario], open)?;
        let logged = firmware.zip(logs).map(|(firmware, logs)| firmware.fly(logs));
        // If a log fails, all other results are still written; the error is reported at the end.
        report(&folder, &flown, &[], self.json)?;
        let converted = mcap.map(FlightMcap::finish);
        logged.transpose()?.iter().flatten().for_each(|line| say(line));
        converted.transpose()?;
        Ok(ExitCode::from(u8::from(flown.iter().any(|flown| flown.run.lost.is_some()))))
    }
}

impl FlyArgs {
    fn fly_plan(self) -> Result<ExitCode, CommandError> {
        let FlyArgs { scenario, controllers, seed, exact_log, ulog, mcap, on, flying, json, .. } = self;
        let path = scenario.path().to_path_buf();
        if !controllers.is_empty() || json.json || flying.log_hz.is_some() || seed.is_some() {
            let options = "--controller, --seed, --log-hz and --json";
            return Err(format!("{}: {options} do not apply to a plan; leave them out", path.display()).into());
        }
        PlanFlight { path, on, duration: flying.duration, exact_log, ulog, mcap }.run()
    }
}

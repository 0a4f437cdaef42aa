//! `sitl scenarios` and `sitl check`.

use super::json::JsonArgs;
use super::target::TargetArg;
use super::terminal::{CommandError, print};
use super::{described, json};
use afbc_campaign::Campaign;
use afbc_campaign::subject::{Subject, SubjectKind};
use afbc_files::OutputFile;
use afbc_files::read::BuiltIn;
use afbc_scenario::contender::Contender;
use afbc_scenario::trajectory::{Trajectory, polynomial};
use afbc_scenario::{BUILT_IN, Scenario, built_in};
use afbc_vehicles::Vehicle;
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;

/// List the built-in scenarios, or print one of them to start from
///
/// `sitl scenarios hover > my.toml` writes a scenario file to edit and to fly with `sitl fly my.toml`.
#[derive(Args, Debug)]
pub(crate) struct ScenariosArgs {
    /// Built-in scenario to print
    #[arg(conflicts_with = "json")]
    name: Option<String>,

    #[command(flatten)]
    json: JsonArgs,
}

impl ScenariosArgs {
    /// Prints the list or the file.
    pub(super) fn run(self) -> Result<ExitCode, CommandError> {
        match self.name {
            Some(name) => print(built_in(&name).ok_or_else(|| SubjectKind::Scenario.unknown(&name))?.text)?,
            None => {
                let all = BUILT_IN.iter().map(BuiltIn::read).collect::<Result<Vec<_>, _>>()?;
                match self.json.json {
                    true => json::print_value(&all.iter().map(described::scenario).collect::<Vec<_>>())?,
                    false => print(&all.iter().map(line).collect::<String>())?,
                }
            }
        }
        Ok(ExitCode::SUCCESS)
    }
}

fn line(scenario: &Scenario) -> String {
    let Scenario { name, duration_s, description, .. } = scenario;
    format!("{name:<12}{duration_s:>4} s  {description}\n")
}

/// Check a scenario, a campaign or a vehicle without flying it; exits with 2 and a line for every mistake
#[derive(Args, Debug)]
pub(crate) struct CheckArgs {
    /// Name of a built-in scenario, campaign or vehicle, or path of a file
    scenario: TargetArg,

    /// Also write the polynomials of the scenario's path to this file, in the format of the Crazyflie's tools; the path
    /// must be minimum-snap or from a file
    #[arg(long, value_name = "FILE")]
    polynomials: Option<PathBuf>,

    /// Replace an existing file of --polynomials
    #[arg(long, requires = "polynomials")]
    force: bool,

    #[command(flatten)]
    json: JsonArgs,
}

impl CheckArgs {
    /// Checks the file and prints a summary, or writes the polynomials of its path.
    pub(super) fn run(self) -> Result<ExitCode, CommandError> {
        if let Some(path) = self.polynomials {
            let scenario = self.scenario.scenario()?;
            let Trajectory::Polynomials(pieces) = &scenario.trajectory else {
                let cure = "only a trajectory of kind \"minimum-snap\" or \"file\" has polynomials";
                return Err(format!("--polynomials: {} has none; {cure}", scenario.name).into());
            };
            let text = polynomial::written(pieces);
            let output = OutputFile::forcible(&path, "--polynomials", self.force)?;
            output.write(|out| out.write_all(text.as_bytes()))?;
            return Ok(ExitCode::SUCCESS);
        }
        match (self.scenario.any()?, self.json.json) {
            (Subject::Scenario(scenario), true) => json::print_value(&described::scenario(&scenario))?,
            (Subject::Campaign(campaign), true) => json::print_value(&described::campaign(&campaign))?,
            (Subject::Vehicle(vehicle), true) => json::print_value(&described::vehicle(&vehicle))?,
            (Subject::Scenario(scenario), false) => {
                let Scenario { name, duration_s, model, contenders, .. } = scenario;
                print(&format!("{name}: ok, {duration_s} s, {} plant, {}\n", model.name(), titles(&contenders)))?;
            }
            (Subject::Campaign(campaign), false) => {
                let Campaign { name, flights, scenario: Scenario { duration_s, model, contenders, .. }, .. } = campaign;
                let (plant, titles, file) = (model.name(), titles(&contenders), self.scenario);
                print(&format!(
                    "{name}: ok, {flights} flights of {duration_s} s, {plant} plant, {titles}; this is a campaign; \
                     fly it with `sitl campaign {file}`\n"
                ))?;
            }
            (Subject::Vehicle(vehicle), false) => {
                let (Vehicle { name, rotors, .. }, file) = (*vehicle, self.scenario);
                let rotors = rotors.len();
                print(&format!(
                    "{name}: ok, {rotors} rotors; this is a vehicle; fly it with `sitl fly hover --vehicle {file}`\n"
                ))?;
            }
        }
        Ok(ExitCode::SUCCESS)
    }
}

fn titles(contenders: &[Contender]) -> String {
    contenders.iter().map(Contender::title).collect::<Vec<_>>().join(", ")
}

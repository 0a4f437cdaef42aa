//! `sitl scenarios` and `sitl check`.

use super::json;
use super::json::Json;
use super::target::Target;
use super::terminal::{Failure, print};
use afbc_campaign::Campaign;
use afbc_campaign::subject::{Subject, SubjectKind};
use afbc_files::Error;
use afbc_reader::BuiltIn;
use afbc_scenario::contender::Contender;
use afbc_scenario::trajectory::{Trajectory, polynomial};
use afbc_scenario::{BUILT_IN, Scenario, built_in};
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;

/// List the built-in scenarios, or print one of them to start from
///
/// `sitl scenarios hover > my.toml` writes a scenario file to edit and to fly with `sitl fly my.toml`.
#[derive(Args, Debug)]
pub(crate) struct Scenarios {
    /// Built-in scenario to print
    #[arg(conflicts_with = "json")]
    name: Option<String>,

    #[command(flatten)]
    json: Json,
}

impl Scenarios {
    /// Prints the list or the file.
    pub(super) fn run(self) -> Result<ExitCode, Failure> {
        match self.name {
            Some(name) => print(built_in(&name).ok_or_else(|| SubjectKind::Scenario.unknown(&name))?.text)?,
            None => {
                let all = BUILT_IN.iter().map(BuiltIn::read).collect::<Result<Vec<_>, _>>()?;
                match self.json.json {
                    true => json::print_value(&all.iter().map(json::scenario).collect::<Vec<_>>())?,
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

/// Check a scenario or a campaign without flying it; exits with 2 and a message on the first error
#[derive(Args, Debug)]
pub(crate) struct Check {
    /// Name of a built-in scenario or campaign, or path of a file
    scenario: Target,

    /// Also write the polynomials of a scenario's minimum-snap path, or of a path from a file, into this file, as the
    /// Crazyflie's tools do
    #[arg(long, value_name = "FILE")]
    polynomials: Option<PathBuf>,

    #[command(flatten)]
    json: Json,
}

impl Check {
    /// Prints a summary of the file.
    pub(super) fn run(self) -> Result<ExitCode, Failure> {
        if let Some(path) = self.polynomials {
            let scenario = self.scenario.scenario()?;
            let Trajectory::Polynomials(pieces) = &scenario.trajectory else {
                let cure = "a trajectory of kind \"minimum-snap\" or \"file\" has some";
                return Err(format!("--polynomials: {} has none; {cure}", scenario.name).into());
            };
            let text = polynomial::written(pieces);
            return match std::fs::write(&path, text) {
                Ok(()) => Ok(ExitCode::SUCCESS),
                Err(source) => Err(Error::Write { path, source }.into()),
            };
        }
        match (self.scenario.either()?, self.json.json) {
            (Subject::Scenario(scenario), true) => json::print_value(&json::scenario(&scenario))?,
            (Subject::Campaign(campaign), true) => json::print_value(&json::campaign(&campaign))?,
            (Subject::Scenario(scenario), false) => {
                let Scenario { name, duration_s, model, contenders, .. } = scenario;
                print(&format!("{name}: ok, {duration_s} s, {} plant, {}\n", model.name(), titles(&contenders)))?;
            }
            (Subject::Campaign(campaign), false) => {
                let Campaign { name, flights, scenario: Scenario { duration_s, model, contenders, .. }, .. } = campaign;
                let (plant, titles, file) = (model.name(), titles(&contenders), self.scenario);
                print(&format!(
                    "{name}: ok, {flights} flights of {duration_s} s, {plant} plant, {titles}; this is a campaign: \
                     sitl campaign {file}\n"
                ))?;
            }
        }
        Ok(ExitCode::SUCCESS)
    }
}

fn titles(contenders: &[Contender]) -> String {
    contenders.iter().map(Contender::title).collect::<Vec<_>>().join(", ")
}

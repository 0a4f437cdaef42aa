//! `sitl results`: makes the table of `docs/reference/results.md`.

use super::json::JsonArgs;
use super::progress::CommandProgress;
use super::terminal::{CommandError, print};
use super::{interrupt, json, page};
use afbc_report::flights;
use afbc_report::results;
use afbc_sim::flown::ScenarioFlight;
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;

/// Fly the paper's experiment in every interpretation, and print the results as a Markdown table
#[derive(Args, Debug)]
pub(crate) struct ResultsArgs {
    /// Write the table into this page instead, between its lines `results: begin` and `results: end`
    #[arg(long, value_name = "PAGE", conflicts_with = "json")]
    write: Option<PathBuf>,

    #[command(flatten)]
    json: JsonArgs,
}

impl ResultsArgs {
    /// Flies, then prints or writes the table.
    pub(super) fn run(self) -> Result<ExitCode, CommandError> {
        let Some(path) = self.write else {
            let flown = fly()?;
            match self.json.json {
                true => {
                    let flown: Vec<_> = flown.into_iter().map(|(_, flown)| flown).collect();
                    json::print_written(|out| flights::json(out, &flown))?;
                }
                false => print(&results::markdown(&flown))?,
            }
            return Ok(ExitCode::SUCCESS);
        };
        page::write(&path, results::MARKERS, || Ok(results::markdown(&fly()?)))?;
        Ok(ExitCode::SUCCESS)
    }
}

/// Flies all scenarios of the table.
fn fly() -> Result<Vec<(String, ScenarioFlight)>, CommandError> {
    interrupt::ends_it()?;
    let scenarios = results::scenarios()?;
    let flights = scenarios.iter().map(|(_, scenario)| scenario.contenders.len() as u64).sum();
    let progress = CommandProgress::new("results", "flights", flights, 0);
    let flown = results::fly(scenarios, &|| progress.add(1))?;
    drop(progress);
    interrupt::is_too_late();
    Ok(flown)
}

//! `sitl compare --suite` and `sitl suites`: flies or lists suites, which are named lists of flights.

use super::comparison_output::ComparisonOutputArgs;
use super::terminal::{CommandError, print};
use super::{interrupt, over_seeds, page, random, rough};
use afbc_campaign::compare::Comparison;
use afbc_campaign::random::NAME;
use afbc_campaign::rough::NAME as ROUGH;
use afbc_campaign::suite::{self, SUITES, Suite};
use afbc_files::read::{BuiltIn, FileError};
use afbc_report::suite::{self as report, FlownSuite};
use afbc_scenario::contender::Contender;
use afbc_sim::LogRate;
use clap::Args;
use std::process::ExitCode;

/// List the built-in suites of flights, or print one of them to start from
///
/// `sitl suites field > my.toml` writes a suite to edit and to fly with `sitl compare --suite my.toml`.
#[derive(Args, Debug)]
pub(crate) struct SuitesArgs {
    /// Built-in suite to print
    name: Option<String>,
}

impl SuitesArgs {
    /// Prints the list or the file.
    pub(super) fn run(self) -> Result<ExitCode, CommandError> {
        match self.name {
            Some(name) if [NAME, ROUGH].contains(&name.as_str()) => {
                let cure = format!("fly it with `sitl compare --suite {name} --seed N`");
                let problem = format!(
                    "this suite is drawn from a seed, so it has no file; {cure}; docs/suites.md says what is drawn"
                );
                return Err(FileError::whole(&name, problem).into());
            }
            Some(name) => print(BuiltIn::named(&SUITES, &name).ok_or_else(|| suite::unknown(&name))?.text)?,
            None => {
                let all = SUITES.iter().map(BuiltIn::read).collect::<Result<Vec<_>, _>>()?;
                let mut lines: String =
                    all.iter().map(|suite| line(&suite.name, suite.flights.len(), &suite.description)).collect();
                lines += &line(NAME, random::flights(), random::DESCRIPTION);
                lines += &line(ROUGH, rough::flights(), rough::DESCRIPTION);
                print(&lines)?;
            }
        }
        Ok(ExitCode::SUCCESS)
    }
}

fn line(name: &str, flights: usize, description: &str) -> String {
    format!("{name:<15}{flights:>4} flights  {description}\n")
}

/// Flies `suite` under `contenders`. Then writes the results' folder and prints a table, or writes the table into a
/// page.
pub(super) fn run(
    suite: &Suite,
    contenders: &[Contender],
    seeds: Option<u64>,
    against: Option<&str>,
    output: &ComparisonOutputArgs,
) -> Result<ExitCode, CommandError> {
    if let Some(path) = &output.write {
        let [begin, end] = report::markers(&suite.name);
        page::write(path, [&begin, &end], || {
            let comparisons = fly(suite, contenders, seeds, against, || Ok(()))?;
            Ok(report::markdown(FlownSuite { suite, comparisons: &comparisons }))
        })?;
        return Ok(ExitCode::SUCCESS);
    }
    let mut folder = None;
    let comparisons = fly(suite, contenders, seeds, against, || {
        folder = Some(output.place.open("suite")?);
        Ok(())
    })?;
    let Some(folder) = folder else { return Ok(ExitCode::SUCCESS) };
    let flown = FlownSuite { suite, comparisons: &comparisons };
    let written = report::write(&folder, flown)?;
    over_seeds::record(&folder, &written, &comparisons)?;
    let object = |out: &mut Vec<u8>| report::json(out, flown);
    let tables = |format| report::tables(flown, format);
    output.show(&folder, written.len() + 1, object, tables, || report::table(flown))?;
    Ok(ExitCode::SUCCESS)
}

/// Flies the suite; calls `ready` before the first flight, once all scenarios are known to be valid.
fn fly(
    suite: &Suite,
    contenders: &[Contender],
    seeds: Option<u64>,
    against: Option<&str>,
    ready: impl FnOnce() -> Result<(), CommandError>,
) -> Result<Vec<Comparison>, CommandError> {
    let scenarios = suite.under(contenders)?;
    let log_every = LogRate::common(&scenarios)?;
    interrupt::ends_it()?;
    ready()?;
    let comparisons = over_seeds::fly(scenarios, seeds, against, log_every)?;
    interrupt::is_too_late();
    Ok(comparisons)
}

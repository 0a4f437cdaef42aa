//! Options, flights and output that `paper`, `fly` and `campaign --flight` share.

use super::comparison_output::show;
use super::json::JsonArgs;
use super::progress::CommandProgress;
use super::terminal::{CommandError, say};
use super::{interrupt, manifest};
use afbc_files::Folder;
use afbc_report::claims::Claim;
use afbc_report::flights;
use afbc_scenario::{DURATION, Scenario};
use afbc_sim::LogRate;
use afbc_sim::flown::ScenarioFlight;
use afbc_sim::run::FlightResult;
use clap::Args;

/// Flights with more steps than this, which take about a second, show their progress.
const QUIET_STEPS: f64 = 1e6;

/// Options of every flight.
#[derive(Args, Clone, Copy, Debug)]
pub(crate) struct FlightArgs {
    /// Length of the flight in seconds, instead of the scenario's
    #[arg(long, value_name = "SECONDS", value_parser = duration)]
    pub(crate) duration: Option<f64>,

    /// Log rows per second, a divisor of 1000; rounded to whole numbers of control steps [default: 100; less for
    /// flights over 10 minutes]
    #[arg(long, value_name = "HZ")]
    pub(crate) log_hz: Option<LogRate>,
}

fn duration(text: &str) -> Result<f64, String> {
    let seconds = text.parse().map_err(|_| "the time must be a number of seconds".to_owned())?;
    DURATION
        .check(seconds)
        .map_err(|_| format!("the time must lie within {} to {} seconds", DURATION.min, DURATION.max))?;
    Ok(seconds)
}

impl FlightArgs {
    /// Flies every scenario under each of its contenders. `open` opens the output folder once all options are checked.
    pub(crate) fn fly(
        self,
        mut scenarios: Vec<Scenario>,
        open: impl FnOnce() -> Result<Folder, CommandError>,
    ) -> Result<(Folder, Vec<ScenarioFlight>), CommandError> {
        interrupt::ends_it()?;
        let mut log_every = Vec::new();
        for scenario in &mut scenarios {
            scenario.duration_s = self.duration.unwrap_or(scenario.duration_s);
            let log_hz = self.log_hz.unwrap_or_else(|| LogRate::usual(scenario.duration_s));
            for contender in &scenario.contenders {
                log_every.push(log_hz.steps(scenario, contender)?);
            }
        }
        // The folder is opened only now, so that a refused command leaves no folder behind.
        let folder = open()?;
        if self.log_hz.is_none() {
            let longest_s = scenarios.iter().map(|scenario| scenario.duration_s).fold(0.0, f64::max);
            LogRate::thinned(longest_s).iter().for_each(|line| say(line));
        }
        let progress = progress(&scenarios);
        let (mut flown, mut log_every) = (Vec::new(), log_every.into_iter());
        for scenario in scenarios {
            for (contender, log_every) in scenario.contenders.iter().zip(&mut log_every) {
                let run = FlightResult::fly(&scenario, contender, log_every)?;
                flown.push(ScenarioFlight { scenario: scenario.clone(), run });
                progress.add(1);
            }
        }
        Ok((folder, flown))
    }
}

/// Returns a progress display on stderr that counts flights. The display is hidden if the flights are short.
fn progress(scenarios: &[Scenario]) -> CommandProgress {
    let steps = |s: &Scenario| s.contenders.iter().map(|contender| s.duration_s / contender.step_s()).sum::<f64>();
    if scenarios.iter().map(steps).sum::<f64>() < QUIET_STEPS {
        return CommandProgress::hidden();
    }
    let runs: usize = scenarios.iter().map(|scenario| scenario.contenders.len()).sum();
    let name = scenarios.first().map_or("", |scenario| scenario.name.as_str());
    CommandProgress::new(name, "flights", runs as u64, 0)
}

/// Writes all files into `folder`, then prints the table and the paths.
pub(crate) fn report(
    folder: &Folder,
    flown: &[ScenarioFlight],
    claims: &[Claim],
    json: JsonArgs,
) -> Result<(), CommandError> {
    interrupt::is_too_late();
    let written = flights::write(folder, flown, claims)?;
    let whole: Vec<manifest::FlownScenario<'_>> =
        flown.iter().map(|ScenarioFlight { scenario, .. }| (scenario, vec![scenario.seed])).collect();
    // The fingerprint covers all flights, but a scenario is written only once, not once for each of its contenders.
    let mut first = whole.clone();
    first.dedup_by(|a, b| a == b);
    manifest::write(folder, &written, &whole, &first)?;
    show(folder, written.len() + 1, json, |out| flights::json(out, flown), || flights::table(flown, claims))
}

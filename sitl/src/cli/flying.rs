//! What `paper` and `fly` have in common: the options, the flights, the output.

use super::log_rate::LogRate;
use super::{Failure, print};
use clap::Args;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use sitl::claims::Claim;
use sitl::output::{self, Flown};
use sitl::run::Run;
use sitl::scenario::{DURATION, Scenario};
use std::path::Path;
use std::time::Duration;

/// Flights of more steps than this, about a second's worth, show their progress.
const QUIET_STEPS: f64 = 1e6;

/// Options of every flight.
#[derive(Args, Clone, Copy, Debug)]
pub(crate) struct Flying {
    /// Length of the flight in seconds, instead of the scenario's
    #[arg(long, value_name = "SECONDS", value_parser = duration)]
    pub(crate) duration: Option<f64>,

    /// Log rows a second, a divisor of 1000; kept to the nearest whole number of control steps
    #[arg(long, value_name = "HZ", default_value = "100")]
    pub(crate) log_hz: LogRate,
}

fn duration(text: &str) -> Result<f64, String> {
    let seconds = text.parse().map_err(|_| "it must be a number of seconds".to_owned())?;
    DURATION.check(seconds).map_err(|_| format!("it must lie within {} to {} seconds", DURATION.min, DURATION.max))?;
    Ok(seconds)
}

impl Flying {
    /// Flies every scenario under each of its contenders, once it is sure that `out` can take what comes of it.
    pub(crate) fn fly(self, mut scenarios: Vec<Scenario>, out: &Path) -> Result<Vec<Flown>, Failure> {
        output::prepare(out)?;
        for scenario in &mut scenarios {
            scenario.duration_s = self.duration.unwrap_or(scenario.duration_s);
        }
        let progress = progress(&scenarios);
        let mut flown = Vec::new();
        for scenario in scenarios {
            for contender in &scenario.contenders {
                let log_every = self.log_hz.steps(&scenario, contender)?;
                progress.set_message(format!("{}, {}", scenario.name, contender.title()));
                let run = Run::fly(&scenario, contender, log_every)?;
                flown.push(Flown { scenario: scenario.clone(), run });
                progress.inc(1);
            }
        }
        progress.finish_and_clear();
        Ok(flown)
    }
}

/// Progress on stderr, one tick a run; nothing if it will not take long or stderr is no terminal.
fn progress(scenarios: &[Scenario]) -> ProgressBar {
    let steps = |s: &Scenario| s.contenders.iter().map(|contender| s.duration_s / contender.step_s()).sum::<f64>();
    if scenarios.iter().map(steps).sum::<f64>() < QUIET_STEPS {
        return ProgressBar::hidden();
    }
    let runs: usize = scenarios.iter().map(|scenario| scenario.contenders.len()).sum();
    let bar = ProgressBar::with_draw_target(Some(runs as u64), ProgressDrawTarget::stderr());
    let style = ProgressStyle::with_template("{spinner} run {pos} of {len} done, {elapsed}: {msg}");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar.enable_steady_tick(Duration::from_millis(100));
    bar
}

/// Writes everything into `out`, then prints the table and where to look.
pub(crate) fn report(out: &Path, flown: &[Flown], claims: &[Claim]) -> Result<(), Failure> {
    let written = output::write(out, flown, claims)?;
    let table = output::table(flown, claims);
    let (count, page) = (written.len(), out.join("report.html"));
    print(&format!("{}\n\n{count} files in {}; open {}\n", table.trim_end(), out.display(), page.display()))
}

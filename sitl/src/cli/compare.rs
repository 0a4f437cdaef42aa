//! `sitl compare`: every contender in every scenario.

use super::target::Target;
use super::{Failure, print};
use clap::Args;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use sitl::compare::{self, standard};
use sitl::output;
use sitl::scenario::{Contender, Scenario};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

/// Log rows a second.
const LOG_HZ: f64 = 100.0;

/// Fly every controller through every scenario, and compare
///
/// Without arguments: AFBC, AFBC as printed, backstepping, PID, geometric and INDI through the built-in scenario
/// `hardware`. What is lost is part of the comparison and no failure.
#[derive(Args, Debug)]
pub(crate) struct Compare {
    /// Built-in scenarios or scenario files; all contenders of each fly all of them
    #[arg(value_name = "SCENARIO")]
    scenarios: Vec<Target>,

    /// Let these fly instead: contenders of the scenarios, afbc, afbc-as-printed, backstepping, pid, geometric, indi
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    controllers: Vec<String>,

    /// Fly each scenario with this many seeds, from its own on, and compare means
    #[arg(long, value_name = "N", default_value = "1", value_parser = clap::value_parser!(u64).range(1..=10_000))]
    seeds: u64,

    /// Folder for table, figures and report
    #[arg(long, value_name = "DIR", default_value = "out/compare")]
    out: PathBuf,
}

impl Compare {
    /// Flies, writes, prints.
    pub(super) fn run(self) -> Result<ExitCode, Failure> {
        let named = if self.scenarios.is_empty() { &[Target::from("hardware")][..] } else { &self.scenarios };
        let mut scenarios = named.iter().map(Target::scenario).collect::<Result<Vec<_>, _>>()?;
        let own = if self.scenarios.is_empty() { standard() } else { compare::contenders(&scenarios) };
        let contenders = if self.controllers.is_empty() { own } else { choose(&own, &self.controllers)? };
        for scenario in &mut scenarios {
            scenario.contenders.clone_from(&contenders);
            scenario.check()?;
        }
        output::prepare(&self.out)?;
        let bar = progress(&scenarios, self.seeds);
        let step_s = contenders.iter().map(Contender::step_s).fold(f64::INFINITY, f64::min);
        let log_every = (1.0 / (LOG_HZ * step_s)).round().max(1.0) as u64;
        let comparisons = compare::fly(scenarios, self.seeds, log_every, &|| bar.inc(1))?;
        bar.finish_and_clear();

        let written = output::compare::write(&self.out, &comparisons)?;
        let (table, page) = (output::compare::table(&comparisons), self.out.join("report.html"));
        print(&format!(
            "{}\n\n{} files in {}; open {}\n",
            table.trim_end(),
            written.len(),
            self.out.display(),
            page.display()
        ))?;
        Ok(ExitCode::SUCCESS)
    }
}

/// Those called `names`, in that order: of the scenarios, or else of the standard ones.
fn choose(own: &[Contender], names: &[String]) -> Result<Vec<Contender>, Failure> {
    let standard = standard();
    let mut chosen: Vec<Contender> = Vec::new();
    for name in names {
        let Some(contender) = own.iter().chain(&standard).find(|contender| &contender.name == name) else {
            let mut known: Vec<_> = own.iter().chain(&standard).map(|contender| contender.name.as_str()).collect();
            known.sort_unstable();
            known.dedup();
            let problem = format!("no such controller; there are {}", known.join(", "));
            return Err(format!("--controllers {}: {problem}", name.escape_debug()).into());
        };
        if chosen.iter().any(|other| other.name == contender.name) {
            return Err(format!("--controllers {name}: named twice; once is enough").into());
        }
        chosen.push(contender.clone());
    }
    Ok(chosen)
}

/// Flights done and how long there is to wait, on stderr.
fn progress(scenarios: &[Scenario], seeds: u64) -> ProgressBar {
    let flights = scenarios.iter().map(|scenario| scenario.contenders.len() as u64).sum::<u64>() * seeds;
    let bar = ProgressBar::with_draw_target(Some(flights), ProgressDrawTarget::stderr());
    let style = "{bar:30} {human_pos} of {human_len} flights, {eta} left";
    bar.set_style(ProgressStyle::with_template(style).unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar.enable_steady_tick(Duration::from_millis(250));
    bar
}

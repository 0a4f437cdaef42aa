//! `sitl compare`: flies several controllers in the same scenarios.

use super::comparison_output::ComparisonOutputArgs;
use super::over_seeds::{fly, record};
use super::target::TargetArg;
use super::terminal::CommandError;
use super::vehicle::VehicleArgs;
use super::{interrupt, random, rough, suite};
use afbc_campaign::compare::{self, choose, standard};
use afbc_campaign::suite::suite_at;
use afbc_files::read::words::nearest;
use afbc_report::compare as report;
use afbc_scenario::contender::MONITORED;
use afbc_sim::LogRate;
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;

/// Fly every controller in every scenario, and compare them
///
/// Without arguments, AFBC, AFBC as printed in the paper and every other law fly the built-in scenario `hardware`. With
/// `--suite`, these laws and AFBC with its monitor fly every flight of a suite, each on that flight's vehicle; the
/// report is in out/suite. With `--suite random`, they fly flights drawn from --seed, on all built-in vehicles or one;
/// the ranking is in out/random. With `--suite rough-estimate`, AFBC with its monitor, or another law, flies with
/// sensor errors that the estimator does not expect; the quality of the estimate is in out/rough-estimate. A lost
/// vehicle is a result and does not change the exit code.
#[derive(Args, Debug)]
pub(crate) struct CompareArgs {
    /// Built-in scenarios or scenario files; each scenario is flown by the contenders of all these scenarios
    #[arg(value_name = "SCENARIO")]
    scenarios: Vec<TargetArg>,

    /// Fly this suite instead: name of a built-in suite (`sitl suites`), or path of a suite file
    #[arg(long, value_name = "SUITE", conflicts_with = "scenarios")]
    suite: Option<PathBuf>,

    /// Names of the contenders to fly instead: contenders of the scenarios, any law (afbc, pid...), or afbc-as-printed;
    /// with `--suite` also afbc-monitored
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    controllers: Vec<String>,

    /// Number of consecutive seeds with which each scenario is flown, beginning with the scenario's own; with `--suite
    /// random`, number of seeds from which flights are drawn [default: 10, or 1 if a seed changes nothing; 1 for the
    /// suites random and rough-estimate]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=10_000))]
    seeds: Option<u64>,

    /// Contender with which the others are compared [default: afbc, or else the first]
    #[arg(long, value_name = "NAME")]
    against: Option<String>,

    #[command(flatten)]
    on: VehicleArgs,

    #[command(flatten)]
    output: ComparisonOutputArgs,

    #[command(flatten)]
    random: random::RandomArgs,
}

impl CompareArgs {
    /// Flies, writes the results and prints a table.
    pub(super) fn run(self) -> Result<ExitCode, CommandError> {
        if let Some(path) = &self.suite {
            let own = self.random.own()?;
            let known = compare::standard_and_monitored();
            let is_rough = rough::is_named(path);
            let contenders = match self.controllers.as_slice() {
                [] if is_rough => choose(&known, &[MONITORED.to_owned()])?,
                [] if own.is_empty() => known,
                names => choose(&known, names)?,
            };
            let CompareArgs { random, seeds, against, output, .. } = self;
            let names = contenders.iter().chain(&own).map(|contender| contender.name.as_str());
            flies(against.as_deref(), &names.collect::<Vec<_>>())?;
            if is_rough {
                random.are_for(afbc_campaign::rough::NAME)?;
                if against.is_some() {
                    return Err("--against: --suite rough-estimate compares no contenders; leave --against out".into());
                }
                return rough::run(&random, self.on.vehicle()?, &contenders, seeds.unwrap_or(1), &output);
            }
            if random::is_named(path) {
                random.are_for(afbc_campaign::random::NAME)?;
                if let Some(twice) = own.iter().find(|own| contenders.iter().any(|other| other.name == own.name)) {
                    let name = &twice.name;
                    return Err(format!(
                        "--controllers {name}: --from has a contender of this name; rename that contender"
                    )
                    .into());
                }
                let against = against.as_deref().unwrap_or("afbc");
                return random.run(self.on.vehicle()?, [&contenders, &own], seeds.unwrap_or(1), against, &output);
            }
            let suite = suite_at(path)?;
            if let Some(option) = self.on.vehicle()?.map(|_| "--vehicle").or_else(|| random.given()) {
                let cure = "this option needs --suite random or rough-estimate, but this suite is not drawn; \
                     leave the option out";
                return Err(format!("{option}: {cure}").into());
            }
            return suite::run(&suite, &contenders, seeds, against.as_deref(), &output);
        }
        if let Some(option) = self.random.given() {
            return Err(format!("{option}: only --suite random has this option; leave {option} out").into());
        }
        let named = if self.scenarios.is_empty() { &[TargetArg::from("hardware")][..] } else { &self.scenarios };
        let mut scenarios = named.iter().map(TargetArg::scenario).collect::<Result<Vec<_>, _>>()?;
        let own = if self.scenarios.is_empty() { standard() } else { compare::contenders(&scenarios) };
        let contenders = if self.controllers.is_empty() { own } else { choose(&own, &self.controllers)? };
        for scenario in &mut scenarios {
            *scenario = self.on.put(scenario.clone())?;
            compare::fly_under(scenario, &contenders)?;
        }
        flies(self.against.as_deref(), &contenders.iter().map(|own| own.name.as_str()).collect::<Vec<_>>())?;
        let log_every = LogRate::common(&scenarios)?;
        interrupt::ends_it()?;
        let folder = self.output.place.open("compare")?;
        let comparisons = fly(scenarios, self.seeds, self.against.as_deref(), log_every)?;

        interrupt::is_too_late();
        let written = report::write(&folder, &comparisons)?;
        record(&folder, &written, &comparisons)?;
        let object = |out: &mut Vec<u8>| report::json(out, &comparisons);
        let tables = |format| report::tables(&comparisons, format);
        self.output.show(&folder, written.len() + 1, object, tables, || report::table(&comparisons))?;
        Ok(ExitCode::SUCCESS)
    }
}

/// Checks that `against` names one of the contenders.
fn flies(against: Option<&str>, names: &[&str]) -> Result<(), CommandError> {
    let Some(against) = against.filter(|against| !names.contains(against)) else { return Ok(()) };
    let cure = match nearest(against, names.iter().copied()) {
        Some(similar) => format!("did you mean {similar}?"),
        None => format!("name one of {}", names.join(", ")),
    };
    Err(format!("--against {against}: does not fly; {cure}").into())
}

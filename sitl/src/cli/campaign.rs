//! `sitl campaign`, `sitl merge` and `sitl campaigns`.

use super::flight_args::{FlightArgs, report};
use super::json::JsonArgs;
use super::output_folder::OutputFolderArgs;
use super::progress::CommandProgress;
use super::target::TargetArg;
use super::terminal::{CommandError, columns, print, say};
use super::vehicle::VehicleArgs;
use super::{described, interrupt, json, manifest};
use afbc_campaign::subject::SubjectKind;
use afbc_campaign::{self as campaign, BUILT_IN, Campaign, CampaignFolder, CampaignSummary, Manifest, Shard, built_in};
use afbc_files::read::BuiltIn;
use afbc_report::{campaign as report, for_terminal};
use afbc_sim::LogRate;
use clap::{Args, value_parser};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::OnceLock;
use std::sync::atomic::AtomicBool;
use std::thread;

/// Option that selects a part of a campaign.
const SHARD: &str = "--shard";

/// Fly a campaign: one scenario many times, with randomly drawn vehicles, weather and faults
///
/// Every contender flies the same draws. Finished flights are kept; after Ctrl-C or a crash, the same command resumes.
/// See docs/campaigns.md.
#[derive(Args, Debug)]
pub(crate) struct CampaignArgs {
    /// Name of a built-in campaign, or path of a campaign file
    campaign: TargetArg,

    /// Fly only the first N flights
    #[arg(long, value_name = "N", conflicts_with = "flight", value_parser = value_parser!(u64).range(1..))]
    flights: Option<u64>,

    /// Number of cores [default: all]; the results do not depend on it
    #[arg(long, value_name = "N", value_parser = threads)]
    threads: Option<u64>,

    /// Fly only part I of N, to share a campaign among N machines; `sitl merge` joins the parts
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,

    /// Fly only this flight and report on it as `sitl fly` does; exits with 1 if a vehicle is lost
    #[arg(long, value_name = "INDEX", conflicts_with_all = ["threads", "shard"])]
    flight: Option<u64>,

    /// Contender to fly with --flight, instead of all contenders; may be given more than once
    #[arg(long = "contender", value_name = "NAME", requires = "flight")]
    contenders: Vec<String>,

    /// Log rows per second with --flight, a divisor of 1000 [default: 100; less for more than 10 minutes]
    #[arg(long, value_name = "HZ", requires = "flight")]
    log_hz: Option<LogRate>,

    #[command(flatten)]
    on: VehicleArgs,

    #[command(flatten)]
    place: OutputFolderArgs,

    #[command(flatten)]
    json: JsonArgs,
}

impl CampaignArgs {
    /// Flies the campaign, writes the results and prints a summary.
    pub(super) fn run(self) -> Result<ExitCode, CommandError> {
        let plan = self.on.campaign(self.campaign.campaign()?)?;
        let flights = self.flights.unwrap_or(plan.flights);
        if flights > plan.flights {
            return Err(format!("--flights {flights}: the campaign has only {}; fly fewer", plan.flights).into());
        }
        let plan = Campaign { flights, ..plan };
        if let Some(flight) = self.flight {
            return self.fly_again(&plan, flight);
        }
        let shard = self.shard.unwrap_or(Shard::WHOLE);
        if shard.of > plan.flights {
            return Err(
                format!("--shard {shard}: the campaign has only {} flights; use fewer parts", plan.flights).into()
            );
        }
        let name =
            if shard.of > 1 { format!("{}-{}-of-{}", plan.name, shard.index, shard.of) } else { plan.name.clone() };
        let (out, flights) = (self.place.path(&name), shard.count(plan.flights));
        let threads = useful(self.threads, flights);
        interrupt::ends_with(format!(
            "stopped; finished flights are in {}; run the same command to resume",
            out.display()
        ))?;
        let folder = CampaignFolder::open(&out, Manifest::new(&plan, shard), self.place.force)?;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        // The first call reports flights of earlier runs.
        let progress: OnceLock<CommandProgress> = OnceLock::new();
        let done = |done| {
            let mut first = false;
            let begin = || {
                first = true;
                CommandProgress::new(&plan.name, "flights", flights, done)
            };
            let progress = progress.get_or_init(begin);
            if !first {
                progress.add(done);
            }
        };
        // Ctrl-C ends the program directly, since the folder is consistent at any time.
        let never = AtomicBool::new(false);
        let summary = pool.install(|| campaign::fly(&plan, &folder, &never, &done));
        drop(progress);
        let summary = summary?.ok_or("stopped")?;
        let flown = vec![manifest::words(&(&plan.scenario, vec![plan.seed]))?];
        let origin = Some((manifest::own_command(), flown));
        conclude(&folder, &summary, origin, &self.on.arguments(&self.campaign), self.json)
    }

    /// Flies one flight, and writes its full results.
    fn fly_again(self, plan: &Campaign, flight: u64) -> Result<ExitCode, CommandError> {
        if flight >= plan.flights {
            return Err(
                format!("--flight {flight}: the campaign has flights 0 to {}; choose one", plan.flights - 1).into()
            );
        }
        let mut scenario = plan.flight(flight)?;
        scenario.name = format!("{}-{flight}", plan.name);
        let names: Vec<_> = scenario.contenders.iter().map(|contender| contender.name.clone()).collect();
        if let Some(unknown) = self.contenders.iter().find(|name| !names.contains(name)) {
            return Err(format!(
                "--contender {unknown}: the campaign has no such contender; its contenders are {}",
                names.join(", ")
            )
            .into());
        }
        if !self.contenders.is_empty() {
            scenario.contenders.retain(|contender| self.contenders.contains(&contender.name));
        }
        let name = scenario.name.clone();
        let open = || self.place.open(&name);
        let (folder, flown) = FlightArgs { duration: None, log_hz: self.log_hz }.fly(vec![scenario], open)?;
        report(&folder, &flown, &[], self.json)?;
        Ok(ExitCode::from(u8::from(flown.iter().any(|flown| flown.run.lost.is_some()))))
    }
}

fn threads(text: &str) -> Result<u64, &'static str> {
    text.parse()
        .ok()
        .filter(|threads| *threads > 0)
        .ok_or("the number of threads must be a whole number from 1 on, such as 4")
}

/// Returns the number of threads: `wanted`, or else all cores, but at most the number of cores and of `flights`.
fn useful(wanted: Option<u64>, flights: u64) -> usize {
    let cores = thread::available_parallelism().map_or(1, |cores| cores.get() as u64);
    let most = cores.min(flights);
    if let Some(wanted) = wanted.filter(|wanted| *wanted > most) {
        let why = if flights < cores { format!("{flights} flights") } else { format!("{cores} cores") };
        say(&format!("--threads {wanted}: using only {most}, since there are {why}; more would not be faster"));
    }
    wanted.unwrap_or(most).min(most) as usize
}

/// Command that makes a campaign's results, and the scenarios that it flies.
type ResultsOrigin = (Vec<String>, Vec<manifest::FlownJson>);

/// Writes and prints the results of all flights. Writes a manifest too, if the origin of the results is known.
fn conclude(
    folder: &CampaignFolder,
    summary: &CampaignSummary,
    origin: Option<ResultsOrigin>,
    target: &str,
    json: JsonArgs,
) -> Result<ExitCode, CommandError> {
    let out = folder.path();
    let mut files = report::write(folder.output_folder(), summary)?;
    if let Some((command, flown)) = origin {
        files.extend(folder.sealed());
        manifest::write_as(folder.output_folder(), &files, command, summary.manifest.fingerprint.clone(), flown)?;
    }
    if json.json {
        json::print_written(|out| report::json(out, summary))?;
        return Ok(ExitCode::SUCCESS);
    }
    let (table, shard) = (for_terminal(columns(), || report::table(summary, target)), summary.manifest.shard);
    let part = if shard.of > 1 { format!("part {shard} only; ") } else { String::new() };
    let (rows, page) = (out.join("results.parquet"), out.join("report.html"));
    print(&format!("{table}\n{part}every flight is in {}; open {}\n", rows.display(), page.display()))?;
    Ok(ExitCode::SUCCESS)
}

/// Join the parts of a campaign flown by `sitl campaign --shard`, with the same result as on one machine
#[derive(Args, Debug)]
pub(crate) struct MergeArgs {
    /// Folders of all parts
    #[arg(required = true, value_name = "DIR")]
    shards: Vec<PathBuf>,

    /// Folder for results and report
    #[arg(long, short, value_name = "DIR")]
    out: PathBuf,

    /// Write into the folder even if the folder holds something else; replaces files of the same names
    #[arg(long)]
    force: bool,

    #[command(flatten)]
    json: JsonArgs,
}

impl MergeArgs {
    /// Merges the parts, writes the results and prints a summary.
    pub(super) fn run(self) -> Result<ExitCode, CommandError> {
        interrupt::ends_with("stopped; run the same command to start again".into())?;
        let (folder, summary) = campaign::merge(&self.shards, &self.out, self.force)?;
        conclude(&folder, &summary, whole(&self.shards), &summary.manifest.target(), self.json)
    }
}

/// Returns the command that flies all parts at once: the command of the first part without its shard option, if known.
fn whole(parts: &[PathBuf]) -> Option<ResultsOrigin> {
    let part = manifest::read(parts.first()?).ok()?;
    let mut command = part.command;
    let shard = command.iter().position(|word| word == SHARD || word.starts_with(&format!("{SHARD}=")))?;
    let words = if command.get(shard).is_some_and(|word| word == SHARD) { 2 } else { 1 };
    command.drain(shard..command.len().min(shard + words));
    Some((command, part.flown))
}

/// List the built-in campaigns, or print one of them to start from
///
/// `sitl campaigns robustness > my.toml` writes a campaign file to edit and to fly with `sitl campaign my.toml`.
#[derive(Args, Debug)]
pub(crate) struct CampaignsArgs {
    /// Built-in campaign to print
    #[arg(conflicts_with = "json")]
    name: Option<String>,

    #[command(flatten)]
    json: JsonArgs,
}

impl CampaignsArgs {
    /// Prints the list or the file.
    pub(super) fn run(self) -> Result<ExitCode, CommandError> {
        match self.name {
            Some(name) => print(built_in(&name).ok_or_else(|| SubjectKind::Campaign.unknown(&name))?.text)?,
            None => {
                let all = BUILT_IN.iter().map(BuiltIn::read).collect::<Result<Vec<_>, _>>()?;
                match self.json.json {
                    true => json::print_value(&all.iter().map(described::campaign).collect::<Vec<_>>())?,
                    false => print(&all.iter().map(line).collect::<String>())?,
                }
            }
        }
        Ok(ExitCode::SUCCESS)
    }
}

fn line(plan: &Campaign) -> String {
    let Campaign { name, flights, description, .. } = plan;
    format!("{name:<12}{flights:>6} flights  {description}\n")
}

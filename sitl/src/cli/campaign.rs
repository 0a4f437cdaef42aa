//! `sitl campaign`, `sitl merge` and `sitl campaigns`: many flights.

use super::flying::{Flying, report};
use super::log_rate::LogRate;
use super::progress::Progress;
use super::{Failure, INTERRUPTED, print, say};
use clap::Args;
use sitl::campaign::{self, BUILT_IN, Campaign as Plan, Folder, Manifest, Shard, Summary, built_in};
use sitl::output;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

/// Fly a campaign: one scenario, many times, with drawn vehicles, weather and faults
///
/// Every contender flies the same draws. What is flown stays: after Ctrl-C or worse, the same command goes on. See
/// docs/campaigns.md.
#[derive(Args, Debug)]
pub(crate) struct Campaign {
    /// Name of a built-in campaign, or path of a campaign file
    campaign: PathBuf,

    /// Cores to fly on [default: all]; the results are the same
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,

    /// Fly part I of N only, as one of N machines; `sitl merge` joins the parts
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,

    /// Fly this one flight and report on it as `sitl fly` does; exits with 1 if a vehicle is lost
    #[arg(long, value_name = "INDEX", conflicts_with_all = ["threads", "shard"])]
    flight: Option<u64>,

    /// Contender of that one flight, instead of all; may be given more than once
    #[arg(long = "contender", value_name = "NAME", requires = "flight")]
    contenders: Vec<String>,

    /// Log rows a second of that one flight, a divisor of 1000 [default: 100; fewer of more than 10 minutes]
    #[arg(long, value_name = "HZ", requires = "flight")]
    log_hz: Option<LogRate>,

    /// Folder for results and report [default: out/ and the campaign's name, with the shard or flight if there is one]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

impl Campaign {
    /// Flies, writes, prints.
    pub(super) fn run(self) -> Result<ExitCode, Failure> {
        let plan = plan(&self.campaign)?;
        if let Some(flight) = self.flight {
            return self.fly_again(&plan, flight);
        }
        let shard = self.shard.unwrap_or(Shard::WHOLE);
        if shard.of > plan.flights {
            return Err(
                format!("--shard {shard}: there are only {} flights; cut them into fewer parts", plan.flights).into()
            );
        }
        let name =
            if shard.of > 1 { format!("{}-{}-of-{}", plan.name, shard.index, shard.of) } else { plan.name.clone() };
        let out = self.out.unwrap_or_else(|| Path::new("out").join(name));
        let folder = Folder::open(&out, Manifest::new(&plan, shard))?;

        let stop = Arc::new(AtomicBool::new(false));
        let stopper = Arc::clone(&stop);
        ctrlc::set_handler(move || stopper.store(true, Ordering::Relaxed))?;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(self.threads.map_or(0, NonZeroUsize::get)).build()?;
        let flights = shard.flights(plan.flights).len() as u64;
        // The first to be heard of are those of earlier runs.
        let progress: OnceLock<Progress> = OnceLock::new();
        let done = |done| {
            let mut first = false;
            let begin = || {
                first = true;
                Progress::new(&plan.name, "flights", flights, done)
            };
            let progress = progress.get_or_init(begin);
            if !first {
                progress.add(done);
            }
        };
        let summary = pool.install(|| campaign::fly(&plan, &folder, &stop, &done));
        drop(progress);
        match summary? {
            Some(summary) => conclude(&out, &summary, &self.campaign.to_string_lossy()),
            None => {
                say(&format!(
                    "stopped; what was flown is in {}, and the same command goes on from there",
                    out.display()
                ));
                Ok(ExitCode::from(INTERRUPTED))
            }
        }
    }

    /// One flight, with all that can be shown of it.
    fn fly_again(self, plan: &Plan, flight: u64) -> Result<ExitCode, Failure> {
        if flight >= plan.flights {
            return Err(
                format!("--flight {flight}: the campaign has flights 0 to {}; choose one", plan.flights - 1).into()
            );
        }
        let mut scenario = plan.flight(flight)?;
        scenario.name = format!("{}-{flight}", plan.name);
        let names: Vec<_> = scenario.contenders.iter().map(|contender| contender.name.clone()).collect();
        if let Some(unknown) = self.contenders.iter().find(|name| !names.contains(name)) {
            return Err(format!("--contender {unknown}: not in the campaign; it has: {}", names.join(", ")).into());
        }
        if !self.contenders.is_empty() {
            scenario.contenders.retain(|contender| self.contenders.contains(&contender.name));
        }
        let out = self.out.unwrap_or_else(|| Path::new("out").join(&scenario.name));
        let flown = Flying { duration: None, log_hz: self.log_hz }.fly(vec![scenario], &out)?;
        report(&out, &flown, &[])?;
        Ok(ExitCode::from(u8::from(flown.iter().any(|flown| flown.run.lost.is_some()))))
    }
}

/// The campaign of this name or path. A plain name is a built-in campaign first, then a file.
fn plan(path: &Path) -> Result<Plan, Failure> {
    let Some(name) = path.to_str().filter(|text| !text.contains(['/', '\\', '.'])) else {
        return Ok(campaign::load(path)?);
    };
    match built_in(name) {
        Some(built_in) => Ok(built_in.campaign()?),
        None if path.exists() => Ok(campaign::load(path)?),
        None => Err(unknown(name)),
    }
}

/// There is neither a built-in campaign nor a file of that name.
fn unknown(name: &str) -> Failure {
    let cure = "`sitl campaigns` lists the built-in ones; a file needs its path, as in ./my.toml";
    format!("{}: no such campaign; {cure}", name.escape_debug()).into()
}

/// Writes and prints what is to be said of all flights.
fn conclude(out: &Path, summary: &Summary, target: &str) -> Result<ExitCode, Failure> {
    output::campaign::write(out, summary)?;
    let (table, shard) = (output::campaign::table(summary, target), summary.manifest.shard);
    let part = if shard.of > 1 { format!("part {shard} only; ") } else { String::new() };
    let (rows, page) = (out.join("results.parquet"), out.join("report.html"));
    print(&format!("{table}\n{part}every flight is in {}; open {}\n", rows.display(), page.display()))?;
    Ok(ExitCode::SUCCESS)
}

/// Join the parts of a campaign that `sitl campaign --shard` flew, into what one machine would have written
#[derive(Args, Debug)]
pub(crate) struct Merge {
    /// Folder of each part, all of them
    #[arg(required = true, value_name = "DIR")]
    shards: Vec<PathBuf>,

    /// Folder for results and report
    #[arg(long, short, value_name = "DIR")]
    out: PathBuf,
}

impl Merge {
    /// Joins, writes, prints.
    pub(super) fn run(self) -> Result<ExitCode, Failure> {
        let (_folder, summary) = campaign::merge(&self.shards, &self.out)?;
        conclude(&self.out, &summary, &summary.manifest.target())
    }
}

/// List the built-in campaigns, or print one of them to start from
///
/// `sitl campaigns robustness > my.toml` makes a campaign file to change and to fly with `sitl campaign my.toml`.
#[derive(Args, Debug)]
pub(crate) struct Campaigns {
    /// Built-in campaign to print
    name: Option<String>,
}

impl Campaigns {
    /// Prints the list or the file.
    pub(super) fn run(self) -> Result<ExitCode, Failure> {
        match self.name {
            Some(name) => print(built_in(&name).ok_or_else(|| unknown(&name))?.text)?,
            None => print(&list()?)?,
        }
        Ok(ExitCode::SUCCESS)
    }
}

fn list() -> Result<String, Failure> {
    let mut list = String::new();
    for built_in in BUILT_IN {
        let Plan { flights, description, .. } = built_in.campaign()?;
        list += &format!("{:<12}{flights:>6} flights  {description}\n", built_in.name);
    }
    Ok(list)
}

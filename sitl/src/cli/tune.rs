//! `sitl tune`: searches for gains.

use super::fleet::FleetArgs;
use super::json::JsonArgs;
use super::progress::CommandProgress;
use super::target::TargetArg;
use super::terminal::{CommandError, print};
use super::{described, json};
use afbc::Profile;
use afbc_files::OutputFile;
use afbc_scenario::contender::{Contender, ControllerKind};
use afbc_scenario::{Scenario, vehicle_named};
use afbc_tune::{self as tune, SearchOptions, SearchResult};
use afbc_vehicles::Vehicle;
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Search for gains, by the same flights, cost, method and number of tries for every law
///
/// Prints a [[contender]] for a scenario file or, with --vehicle, [gains] for that vehicle's file. Comments give the
/// cost before and after. Ctrl-C ends the search early and keeps the best gains so far. With --fleet, the command tunes
/// every law on every vehicle; after Ctrl-C finished searches are kept, and the same command resumes. See
/// docs/tuning.md.
#[derive(Args, Debug)]
pub(crate) struct TuneArgs {
    /// Law, which starts from hand-tuned gains, or contender of --from or the first --scenario, which starts from its
    /// own gains
    ///
    /// With --fleet, any number of laws [default: all but backstepping, which flies with AFBC's gains].
    #[arg(value_name = "CONTROLLER", required_unless_present = "fleet")]
    contenders: Vec<String>,

    /// Search for the gains of every law on every vehicle, and keep the results in this folder
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["scenarios", "from", "out", "json"])]
    fleet: Option<PathBuf>,

    /// Write the gains found into the vehicles' files in this folder, between two lines of comments
    #[arg(long, value_name = "FOLDER", requires = "fleet")]
    write: Option<PathBuf>,

    /// Fly this built-in scenario or scenario file instead of the training flights; may be given more than once
    #[arg(long = "scenario", value_name = "SCENARIO")]
    scenarios: Vec<TargetArg>,

    /// Start from a contender of this scenario, on the training flights, for example to continue a search
    #[arg(long, value_name = "SCENARIO", conflicts_with = "scenarios")]
    from: Option<TargetArg>,

    /// Start from the present flight gains: the profile's or, with --vehicle, those in the vehicle's file
    #[arg(long, conflicts_with_all = ["scenarios", "from"])]
    flying: bool,

    /// Fly this vehicle: name of a built-in vehicle, or path of a vehicle file; with --fleet, may be given more than
    /// once [default with --fleet: every built-in vehicle]
    #[arg(long = "vehicle", value_name = "VEHICLE")]
    vehicles: Vec<PathBuf>,

    /// Number of gain sets to try
    #[arg(long, value_name = "N", default_value = "1000", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    budget: u32,

    /// Initial step size, in the natural logarithm of every gain; about 0.1 improves gains that are already good
    #[arg(long, value_name = "SIZE", default_value_t = tune::STEP, value_parser = step)]
    step: f64,

    /// Seed of the search; the same seed finds the same gains
    #[arg(long, default_value = "1")]
    seed: u64,

    /// Write the result into this file instead
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,

    /// Replace an existing file
    #[arg(long, requires = "out")]
    force: bool,

    #[command(flatten)]
    json: JsonArgs,
}

impl TuneArgs {
    /// Searches, then prints or writes the gains.
    pub(super) fn run(self) -> Result<ExitCode, CommandError> {
        let scenarios = self.scenarios.iter().map(TargetArg::scenario).collect::<Result<Vec<_>, _>>()?;
        let from = self.from.as_ref().map(TargetArg::scenario).transpose()?;
        let mut vehicles = self.vehicles.iter().map(|path| vehicle_named(path)).collect::<Result<Vec<_>, _>>()?;
        let course = SearchOptions { budget: self.budget as usize, step: self.step, seed: self.seed };
        if let Some(folder) = &self.fleet {
            let (laws, write) = (&self.contenders, self.write.as_deref());
            return FleetArgs { folder, laws, vehicles, course, flying: self.flying, write }.run();
        }
        let [contender] = self.contenders.as_slice() else {
            return Err("more than one controller is named; name one, or a folder with --fleet".into());
        };
        let vehicle = vehicles.pop();
        if !vehicles.is_empty() {
            return Err("more than one --vehicle is named; name one, or a folder with --fleet".into());
        }
        let mut start = start(contender, from.as_ref().or(scenarios.first()), vehicle.as_ref())?;
        if self.flying {
            start = flying(start.kind(), vehicle.as_ref())?;
        }
        // The conditions belong to the training flights, so they apply only to these.
        let alike = scenarios.is_empty();
        if alike {
            start = start.monitored();
        }
        let (training, held_out, conditions) = match &vehicle {
            Some(vehicle) if !alike => {
                let put = |scenario: Scenario| scenario.on(vehicle, Profile::Flight);
                let training = scenarios.into_iter().map(put).collect::<Result<_, _>>()?;
                (training, tune::held_out_on(vehicle)?, Vec::new())
            }
            None if !alike => (scenarios, tune::held_out()?, Vec::new()),
            Some(vehicle) => (tune::training_on(vehicle)?, tune::held_out_on(vehicle)?, tune::conditions_on(vehicle)?),
            None => (tune::training()?, tune::held_out()?, tune::conditions()?),
        };
        // The file is checked before the search, which may take long.
        let output = self.out.as_deref().map(|out| OutputFile::forcible(out, "--out", self.force)).transpose()?;

        let stop = Arc::new(AtomicBool::new(false));
        let stopper = Arc::clone(&stop);
        ctrlc::set_handler(move || stopper.store(true, Ordering::Relaxed))?;
        let progress = CommandProgress::new(&format!("tune {}", contender), "tried", u64::from(self.budget), 0);
        let mut before = 0;
        let found = tune::search(&start, &training, &conditions, course, |tried, cost| {
            progress.note(format!(", least cost {cost:.4}"));
            progress.add((tried - before) as u64);
            before = tried;
            !stop.load(Ordering::Relaxed)
        })?;
        drop(progress);

        let report = || tune::report(&start, &found, [&training, &held_out], &conditions, self.seed);
        if let Some(output) = &output {
            let text = report()?;
            if let Err(error) = output.write(|to| to.write_all(text.as_bytes())) {
                // The result is printed instead, so that the result of a long search is not lost.
                print(&text)?;
                return Err(error.into());
            }
        }
        let SearchResult { before, after, evaluations, .. } = &found;
        match &self.out {
            _ if self.json.json => json::print_value(&described::tuned(&found, &start.name, self.seed))?,
            Some(out) => print(&format!(
                "cost {before:.4} before, {after:.4} after {evaluations} tries; gains in {}\n",
                out.display()
            ))?,
            None => print(&report()?)?,
        }
        Ok(ExitCode::SUCCESS)
    }
}

/// Returns the contender `name` of `scenario` or, if it has none, the law of that name with hand-tuned gains. With a
/// `vehicle`, a scenario's contender gets the vehicle's gains.
fn start(name: &str, scenario: Option<&Scenario>, vehicle: Option<&Vehicle>) -> Result<Contender, CommandError> {
    let own = scenario.map_or(&[][..], |scenario| &scenario.contenders);
    if let Some(contender) = own.iter().find(|contender| contender.name == name).cloned() {
        return Ok(match vehicle {
            Some(vehicle) => contender.on(vehicle, Profile::Flight)?,
            None => contender,
        });
    }
    let law = ControllerKind::named(name);
    let by_hand = |kind| vehicle.map_or_else(|| tune::by_hand(kind), |vehicle| tune::by_hand_on(kind, vehicle));
    law.map(by_hand).ok_or_else(|| {
        let cure = ControllerKind::cure(name);
        let own: Vec<_> = own.iter().map(|contender| contender.name.as_str()).collect();
        let own =
            if own.is_empty() { String::new() } else { format!("; the scenario's contenders {}", own.join(", ")) };
        format!("{}: no such controller; {cure}{own}", name.escape_debug()).into()
    })
}

/// Returns the law with the gains of the profile `flight`.
fn flying(kind: ControllerKind, vehicle: Option<&Vehicle>) -> Result<Contender, CommandError> {
    let contender = Contender::of(kind, Profile::Flight);
    Ok(match vehicle {
        Some(vehicle) => contender.on(vehicle, Profile::Flight)?,
        None => contender,
    })
}

/// Parses a step size.
fn step(text: &str) -> Result<f64, String> {
    let step = text.parse().ok().filter(|step| (0.001..=1.0).contains(step));
    step.ok_or_else(|| "a number from 0.001 to 1".into())
}

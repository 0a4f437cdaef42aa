//! `sitl compare --suite random`: random flights on several vehicles.

use super::comparison_output::ComparisonOutputArgs;
use super::progress::CommandProgress;
use super::target::TargetArg;
use super::terminal::CommandError;
use super::{interrupt, manifest, page};
use afbc_campaign::compare;
use afbc_campaign::random::{self, FLIGHTS, FeedbackSource, FlownRandomFlight, NAME, RandomFlights};
use afbc_campaign::rough::NAME as ROUGH;
use afbc_files::Folder;
use afbc_files::read::BuiltIn;
use afbc_report::random::{self as report, RandomResults};
use afbc_report::suite::markers;
use afbc_scenario::contender::Contender;
use afbc_sim::LogRate;
use afbc_vehicles::{BUILT_IN, Vehicle};
use clap::{Args, ValueEnum};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Description of the suite, in one line.
pub(super) const DESCRIPTION: &str = "drawn from --seed: paths, speeds, wind, payloads and faults, on every vehicle";

/// Options of the suite.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Options of `--suite random` and `--suite rough-estimate`")]
pub(super) struct RandomArgs {
    /// First seed from which flights are drawn; --seeds sets the number of consecutive seeds [default: 1]
    #[arg(long, value_name = "N", requires = "suite", value_parser = clap::value_parser!(u64).range(..1 << 53))]
    pub(super) seed: Option<u64>,

    /// Number of flights per vehicle and seed; for rough-estimate, also per class [default: 12; 1 for rough-estimate]
    #[arg(long, value_name = "K", requires = "suite", value_parser = clap::value_parser!(u64).range(1..=10_000))]
    pub(super) flights: Option<u64>,

    /// Length of every flight of rough-estimate [s] [default: 60, and 600 for one flight in ten]
    #[arg(long, value_name = "S", requires = "suite", value_parser = duration)]
    pub(super) duration: Option<f64>,

    /// Fly on the vehicle's own estimate instead of the true state, with the instruments of this built-in scenario
    #[arg(long, value_name = "SCENARIO", requires = "suite", num_args = 0..=1, default_missing_value = "mocap")]
    on_estimate: Option<InstrumentsArg>,

    /// Fly the contenders of this scenario, with their gains scaled by rule to each vehicle; laws only fly if
    /// --controllers names them
    #[arg(long, value_name = "SCENARIO", requires = "suite")]
    from: Option<TargetArg>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum InstrumentsArg {
    /// Inertial sensor and motion capture
    Mocap,
    /// Inertial sensor, GNSS, barometer, magnetometer
    Outdoor,
}

/// Parses the duration of flights.
fn duration(text: &str) -> Result<f64, String> {
    let range = afbc_scenario::DURATION;
    let seconds = text.parse().ok().filter(|seconds: &f64| range.check(*seconds).is_ok());
    seconds.ok_or_else(|| format!("the time must lie within {} to {} seconds", range.min, range.max))
}

/// True if `path` is the name of this suite.
pub(super) fn is_named(path: &Path) -> bool {
    path == Path::new(NAME)
}

/// Returns the number of flights per seed.
pub(super) const fn flights() -> usize {
    BUILT_IN.len() * FLIGHTS as usize
}

impl RandomArgs {
    /// Returns the name of the first option that was given.
    pub(super) fn given(&self) -> Option<&'static str> {
        let RandomArgs { seed, flights, duration, on_estimate, from } = self;
        let all = [
            (seed.is_some(), "--seed"),
            (flights.is_some(), "--flights"),
            (duration.is_some(), "--duration"),
            (on_estimate.is_some(), "--on-estimate"),
            (from.is_some(), "--from"),
        ];
        all.into_iter().find_map(|(given, name)| given.then_some(name))
    }

    /// Checks that the options given apply to the suite `name`, which is one of two.
    pub(super) fn are_for(&self, name: &str) -> Result<(), CommandError> {
        let all = [
            (self.duration.is_some(), "--duration", ROUGH),
            (self.on_estimate.is_some(), "--on-estimate", NAME),
            (self.from.is_some(), "--from", NAME),
        ];
        match all.into_iter().find(|(given, _, of)| *given && *of != name) {
            Some((_, option, of)) => {
                Err(format!("{option}: only --suite {of} has this option; leave {option} out").into())
            }
            None => Ok(()),
        }
    }

    /// Returns the contenders of `--from`.
    pub(super) fn own(&self) -> Result<Vec<Contender>, CommandError> {
        Ok(self
            .from
            .as_ref()
            .map(TargetArg::scenario)
            .transpose()?
            .map_or_else(Vec::new, |scenario| scenario.contenders))
    }

    /// Draws and flies. Then writes the results' folder and prints a table, or writes the tables into a page.
    pub(super) fn run(
        &self,
        vehicle: Option<Vehicle>,
        contenders: [&[Contender]; 2],
        seeds: u64,
        against: &str,
        output: &ComparisonOutputArgs,
    ) -> Result<ExitCode, CommandError> {
        let seed = self.seed.unwrap_or(1);
        let random = RandomFlights {
            seeds: seed..seed + seeds,
            flights: self.flights.unwrap_or(FLIGHTS),
            seen: match self.on_estimate {
                None => FeedbackSource::Truth,
                Some(InstrumentsArg::Mocap) => FeedbackSource::Mocap,
                Some(InstrumentsArg::Outdoor) => FeedbackSource::Outdoor,
            },
            vehicles: match vehicle {
                Some(vehicle) => vec![vehicle],
                None => BUILT_IN.iter().map(BuiltIn::read).collect::<Result<_, _>>()?,
            },
        };
        if let Some(path) = &output.write {
            let [begin, end] = markers(NAME);
            page::write(path, [&begin, &end], || {
                let flown = fly(&random, contenders, || Ok(()))?;
                Ok(report::markdown(&RandomResults::new(&random, &flown, against)))
            })?;
            return Ok(ExitCode::SUCCESS);
        }
        let mut folder = None;
        let flown = fly(&random, contenders, || {
            folder = Some(output.place.open(NAME)?);
            Ok(())
        })?;
        let Some(folder) = folder else { return Ok(ExitCode::SUCCESS) };
        let judged = RandomResults::new(&random, &flown, against);
        let telling: Vec<_> = judged.telling().into_iter().cloned().collect();
        let log_every = LogRate::common(&telling)?;
        let again = compare::fly(telling, 1, log_every, &|| ())?;
        let written = report::write(&folder, &judged, &again)?;
        record(&folder, &written, &flown)?;
        let object = |out: &mut Vec<u8>| report::json(out, &judged);
        let tables = |format| report::tables(&judged, format);
        output.show(&folder, written.len() + 1, object, tables, || report::table(&judged))?;
        Ok(ExitCode::SUCCESS)
    }
}

/// Writes the manifest of the files. All flights enter the fingerprint; the first flight of each vehicle is written
/// out.
fn record(folder: &Folder, files: &[PathBuf], flown: &[FlownRandomFlight]) -> Result<(), CommandError> {
    let all = flown.iter().map(|flown| (&flown.flight.scenario, vec![flown.flight.scenario.seed]));
    let all: Vec<manifest::FlownScenario<'_>> = all.collect();
    let mut vehicles = BTreeSet::new();
    let firsts = flown.iter().zip(&all).filter(|(flown, _)| vehicles.insert(flown.flight.vehicle.as_str()));
    let firsts: Vec<manifest::FlownScenario<'_>> = firsts.map(|(_, one)| one.clone()).collect();
    manifest::write(folder, files, &all, &firsts)
}

/// Draws all flights, calls `ready` once they are known to be valid, and flies them.
fn fly(
    random: &RandomFlights,
    [contenders, own]: [&[Contender]; 2],
    ready: impl FnOnce() -> Result<(), CommandError>,
) -> Result<Vec<FlownRandomFlight>, CommandError> {
    let drawn = random.under(contenders, own)?;
    interrupt::ends_it()?;
    ready()?;
    let progress = CommandProgress::new("compare", "flights", (drawn.len() * (contenders.len() + own.len())) as u64, 0);
    let flown = random::fly(drawn, &|| progress.add(1))?;
    drop(progress);
    interrupt::is_too_late();
    Ok(flown)
}

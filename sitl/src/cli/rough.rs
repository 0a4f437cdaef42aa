//! `sitl compare --suite rough-estimate`: flights with sensor errors unknown to the vehicle.

use super::comparison_output::ComparisonOutputArgs;
use super::progress::CommandProgress;
use super::random;
use super::terminal::CommandError;
use super::{interrupt, manifest, page};
use afbc_campaign::rough::{self, FlownRoughFlight, NAME, RoughFlights};
use afbc_files::read::BuiltIn;
use afbc_report::rough::{self as report, RoughResults};
use afbc_report::suite::markers;
use afbc_scenario::contender::Contender;
use afbc_vehicles::{BUILT_IN, Vehicle};
use std::collections::BTreeSet;
use std::path::Path;
use std::process::ExitCode;

/// Description of the suite, in one line.
pub(super) const DESCRIPTION: &str =
    "drawn from --seed, with sensor errors that the estimator does not expect, on every vehicle";

/// True if `path` is the name of this suite.
pub(super) fn is_named(path: &Path) -> bool {
    path == Path::new(NAME)
}

/// Returns the number of flights per seed.
pub(super) fn flights() -> usize {
    BUILT_IN.len() * rough::names().count()
}

/// Draws and flies. Then writes the results' folder and prints a table, or writes the table into a page.
pub(super) fn run(
    options: &random::RandomArgs,
    vehicle: Option<Vehicle>,
    contenders: &[Contender],
    seeds: u64,
    output: &ComparisonOutputArgs,
) -> Result<ExitCode, CommandError> {
    let [contender] = contenders else {
        return Err("--controllers: this suite judges the estimate with one law at a time; name one law".into());
    };
    let seed = options.seed.unwrap_or(1);
    let rough = RoughFlights {
        seeds: seed..seed + seeds,
        flights: options.flights.unwrap_or(1),
        duration_s: options.duration,
        vehicles: match vehicle {
            Some(vehicle) => vec![vehicle],
            None => BUILT_IN.iter().map(BuiltIn::read).collect::<Result<_, _>>()?,
        },
    };
    if let Some(path) = &output.write {
        let [begin, end] = markers(NAME);
        page::write(path, [&begin, &end], || {
            let flown = fly(&rough, contender, || Ok(()))?;
            Ok(report::markdown(&RoughResults::new(&rough, &flown)))
        })?;
        return Ok(ExitCode::SUCCESS);
    }
    let mut folder = None;
    let flown = fly(&rough, contender, || {
        folder = Some(output.place.open(NAME)?);
        Ok(())
    })?;
    let Some(folder) = folder else { return Ok(ExitCode::SUCCESS) };
    let results = RoughResults::new(&rough, &flown);
    let written = report::write(&folder, &results)?;
    let all: Vec<manifest::FlownScenario<'_>> =
        flown.iter().map(|flown| (&flown.flight.scenario, vec![flown.flight.scenario.seed])).collect();
    // All flights enter the fingerprint; the first flight of each class is written out.
    let mut classes = BTreeSet::new();
    let firsts = flown.iter().zip(&all).filter(|(flown, _)| classes.insert(flown.flight.class));
    let firsts: Vec<manifest::FlownScenario<'_>> = firsts.map(|(_, one)| one.clone()).collect();
    manifest::write(&folder, &written, &all, &firsts)?;
    let object = |out: &mut Vec<u8>| report::json(out, &results);
    let tables = |format| report::tables(&results, format);
    output.show(&folder, written.len() + 1, object, tables, || report::table(&results))?;
    Ok(ExitCode::SUCCESS)
}

/// Draws all flights, calls `ready` once they are known to be valid, and flies them.
fn fly(
    rough: &RoughFlights,
    contender: &Contender,
    ready: impl FnOnce() -> Result<(), CommandError>,
) -> Result<Vec<FlownRoughFlight>, CommandError> {
    let drawn = rough.draw(contender)?;
    interrupt::ends_it()?;
    ready()?;
    let progress = CommandProgress::new("compare", "flights", drawn.len() as u64, 0);
    let flown = rough::fly(drawn, &|| progress.add(1))?;
    drop(progress);
    interrupt::is_too_late();
    Ok(flown)
}

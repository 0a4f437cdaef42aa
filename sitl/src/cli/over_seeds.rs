//! Flights over several seeds, for comparisons and suites, and their manifest.

use super::manifest;
use super::progress::CommandProgress;
use super::terminal::CommandError;
use afbc_campaign::compare::{self, Comparison};
use afbc_files::Folder;
use afbc_scenario::Scenario;
use std::path::PathBuf;

/// Flies the scenarios and shows progress. Without `seeds`, each scenario has its usual number of seeds.
pub(super) fn fly(
    scenarios: Vec<Scenario>,
    seeds: Option<u64>,
    against: Option<&str>,
    log_every: u64,
) -> Result<Vec<Comparison>, CommandError> {
    let planned = scenarios.into_iter().map(|scenario| {
        let seeds = seeds.unwrap_or_else(|| compare::usual_seeds(&scenario));
        (scenario, seeds)
    });
    let planned: Vec<_> = planned.collect();
    let flights = planned.iter().map(|(scenario, seeds)| scenario.contenders.len() as u64 * seeds).sum();
    let progress = CommandProgress::new("compare", "flights", flights, 0);
    let comparisons = compare::fly_seeds(planned, log_every, &|| progress.add(1))?;
    drop(progress);
    Ok(comparisons.into_iter().map(|comparison| comparison.with_baseline(against)).collect())
}

/// Writes the manifest of a comparison's files.
pub(super) fn record(folder: &Folder, files: &[PathBuf], comparisons: &[Comparison]) -> Result<(), CommandError> {
    let seeds = |comparison: &Comparison| {
        let flights = comparison.entries.first().map_or(&[][..], |first| &first.flights);
        flights.iter().map(|flight| flight.seed).collect()
    };
    let flown: Vec<manifest::FlownScenario<'_>> =
        comparisons.iter().map(|comparison| (&comparison.scenario, seeds(comparison))).collect();
    manifest::write(folder, files, &flown, &flown)
}

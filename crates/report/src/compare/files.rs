//! Writes `comparison.csv` and `comparison.json`.

use crate::differences::{self, FigureOverSeeds};
use crate::words::measured;
use afbc_campaign::compare::{Average, Comparison, ContenderFlights, DISTANCE, FlightOutcome, MEASURES, Measure};
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::{self, Write};

/// Returns the figures of merit in `comparison.csv`, `comparison.json` and `statistics.csv`.
pub(super) fn measures() -> Vec<&'static Measure> {
    [&DISTANCE].into_iter().chain(&MEASURES).collect()
}

/// Writes one row per flight. A lost flight's figures cover the time until the loss. Figures only count from 5 s on.
pub(super) fn csv(out: &mut dyn Write, comparisons: &[Comparison]) -> io::Result<()> {
    let mut csv = csv::Writer::from_writer(out);
    let measures = measures();
    let head = ["scenario", "contender", "controller", "seed"].into_iter().chain(measures.iter().map(|f| f.name));
    csv.write_record(head.chain(["lost_at_s"]))?;
    for comparison in comparisons {
        for entry in &comparison.entries {
            for FlightOutcome { seed, lost, metrics, .. } in &entry.flights {
                let contender = entry.contender();
                let who = [comparison.scenario.name.clone(), contender.name.clone(), contender.kind().name().into()];
                let figures = measures.iter().map(|figure| measured(metrics, (figure.value)(metrics)));
                let lost = lost.map_or(String::new(), |lost| lost.time_s.to_string());
                csv.write_record(who.into_iter().chain([seed.to_string()]).chain(figures).chain([lost]))?;
            }
        }
    }
    csv.flush()
}

#[derive(Serialize)]
struct ComparedJson<'a> {
    scenario: &'a str,
    against: &'a str,
    contenders: Vec<ComparedContenderJson<'a>>,
}

#[derive(Serialize)]
struct ComparedContenderJson<'a> {
    name: &'a str,
    controller: &'a str,
    seeds: Vec<u64>,
    lost: usize,
    /// Mean of each figure; null if a vehicle was lost.
    mean: BTreeMap<&'a str, Option<f64>>,
    standard_deviation: BTreeMap<&'a str, Option<f64>>,
    /// Root mean square distance divided by backstepping's.
    ratio: Option<f64>,
    figures: Vec<FigureOverSeeds>,
}

/// Writes an array with one object per scenario: means, medians and differences over the seeds.
///
/// # Errors
/// Fails if writing to `out` fails.
pub fn json(out: &mut dyn Write, comparisons: &[Comparison]) -> io::Result<()> {
    let compared = comparisons.iter().map(|comparison| {
        let figures = differences::figures(comparison, measures());
        let entries = comparison.entries.iter().zip(figures);
        ComparedJson {
            scenario: &comparison.scenario.name,
            against: differences::baseline(comparison),
            contenders: entries.map(|(entry, figures)| contender(comparison, entry, figures)).collect(),
        }
    });
    serde_json::to_writer_pretty(&mut *out, &compared.collect::<Vec<_>>())?;
    writeln!(out)
}

fn contender<'a>(
    comparison: &Comparison,
    entry: &'a ContenderFlights,
    figures: Vec<FigureOverSeeds>,
) -> ComparedContenderJson<'a> {
    let averages = |part: fn(Average) -> f64| {
        MEASURES.iter().map(|figure| (figure.name, entry.average(figure.value).map(part))).collect()
    };
    ComparedContenderJson {
        name: &entry.contender().name,
        controller: entry.contender().kind().name(),
        seeds: entry.flights.iter().map(|flight| flight.seed).collect(),
        lost: entry.lost(),
        mean: averages(|average| average.mean),
        standard_deviation: averages(|average| average.deviation),
        ratio: comparison.ratio(entry),
        figures,
    }
}

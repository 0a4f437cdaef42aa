//! Writes `suite.csv` and `suite.json`.

use super::FlownSuite;
use super::cells::{FIGURES, SuiteFigure};
use crate::differences::{self, FigureOverSeeds};
use crate::words::measured;
use afbc_campaign::compare::{Comparison, ContenderFlights, FlightOutcome, Measure};
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::{self, Write};

/// Writes one row per flight of each contender. A lost flight's figures cover the time until the loss. Figures only
/// count from 5 s on.
pub(super) fn csv(out: &mut dyn Write, flown: FlownSuite<'_>) -> io::Result<()> {
    let mut csv = csv::Writer::from_writer(out);
    let inputs = (1..=4).map(|input| format!("mean_abs_delta_u{input}_n"));
    let head = ["flight", "contender", "controller", "seed", "rms_m", "largest_m", "rmse_psi_rad"].map(String::from);
    let tail = ["lost_at_s", "lost", "tripped_at_s", "trip"].map(String::from);
    csv.write_record(head.into_iter().chain(inputs).chain(tail))?;
    for comparison in flown.comparisons {
        for entry in &comparison.entries {
            for FlightOutcome { seed, lost, tripped, metrics } in &entry.flights {
                let contender = entry.contender();
                let who = [comparison.scenario.name.clone(), contender.name.clone(), contender.kind().name().into()];
                let errors = [metrics.rmse.xyz().norm(), metrics.max_distance_m, metrics.rmse.w];
                let inputs = metrics.mean_abs_delta_u.iter().copied();
                let figures = errors.into_iter().chain(inputs).map(|figure| measured(metrics, figure));
                let lost = lost.map_or([String::new(), String::new()], |l| [l.time_s.to_string(), l.reason.into()]);
                let trip = tripped.map_or([String::new(), String::new()], |t| [t.time_s.to_string(), t.reason.into()]);
                let row = who.into_iter().chain([seed.to_string()]).chain(figures).chain(lost).chain(trip);
                csv.write_record(row)?;
            }
        }
    }
    csv.flush()
}

fn over_seeds(comparison: &Comparison) -> Vec<Vec<FigureOverSeeds>> {
    differences::figures(comparison, FIGURES.iter().map(|figure| &figure.measure))
}

#[derive(Serialize)]
struct SuiteFlightJson<'a> {
    flight: &'a str,
    description: &'a str,
    against: &'a str,
    published: Vec<PublishedJson<'a>>,
    contenders: Vec<SuiteContenderJson<'a>>,
}

#[derive(Serialize)]
struct PublishedJson<'a> {
    law: &'a str,
    rms_m: f64,
    source: &'a str,
    differs: &'a str,
}

#[derive(Serialize)]
struct SuiteContenderJson<'a> {
    name: &'a str,
    controller: &'a str,
    seeds: Vec<u64>,
    lost: usize,
    first_lost_at_s: Option<f64>,
    tripped: usize,
    first_tripped_at_s: Option<f64>,
    first_trip: Option<&'a str>,
    /// Mean of each figure; null if a vehicle was lost.
    mean: BTreeMap<&'a str, Option<f64>>,
    figures: Vec<FigureOverSeeds>,
}

/// Writes an array with one object per flight: means, medians and differences over the seeds, losses and trips.
///
/// # Errors
/// Fails if writing to `out` fails.
pub fn json(out: &mut dyn Write, flown: FlownSuite<'_>) -> io::Result<()> {
    let sources = &flown.suite.sources;
    let flights = flown.rows().map(|(flight, comparison)| SuiteFlightJson {
        flight: &comparison.scenario.name,
        description: &comparison.scenario.description,
        against: differences::baseline(comparison),
        published: flight
            .published
            .iter()
            .filter_map(|figure| {
                let source = sources.get(figure.source)?;
                let (citation, differs) = (source.citation.as_str(), source.differs.as_str());
                Some(PublishedJson { law: &figure.law, rms_m: figure.rms_m, source: citation, differs })
            })
            .collect(),
        contenders: comparison.entries.iter().zip(over_seeds(comparison)).map(contender).collect(),
    });
    serde_json::to_writer_pretty(&mut *out, &flights.collect::<Vec<_>>())?;
    writeln!(out)
}

fn contender((entry, figures): (&ContenderFlights, Vec<FigureOverSeeds>)) -> SuiteContenderJson<'_> {
    let lost = entry.flights.iter().find_map(|flight| flight.lost);
    let mean = |measure: &Measure| entry.average(measure.value).map(|average| average.mean);
    let trips: Vec<_> = entry.flights.iter().filter_map(|flight| flight.tripped).collect();
    SuiteContenderJson {
        name: &entry.contender().name,
        controller: entry.contender().kind().name(),
        seeds: entry.flights.iter().map(|flight| flight.seed).collect(),
        lost: entry.lost(),
        first_lost_at_s: lost.map(|lost| lost.time_s),
        tripped: trips.len(),
        first_tripped_at_s: trips.first().map(|trip| trip.time_s),
        first_trip: trips.first().map(|trip| trip.reason),
        mean: FIGURES.iter().map(|SuiteFigure { measure, .. }| (measure.name, mean(measure))).collect(),
        figures,
    }
}

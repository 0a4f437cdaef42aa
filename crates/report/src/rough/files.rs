//! Writes `flights.csv` and `rough-estimate.json`.

use super::cells;
use super::judged::RoughResults;
use afbc_campaign::rough::{CLASSES, ClassRow, MIXTURE_MEANING, NAME};
use serde::Serialize;
use std::io::{self, Write};

/// Columns of `flights.csv`.
const HEADS: [&str; 20] = [
    "flight",
    "vehicle",
    "seed",
    "number",
    "class",
    "drawn",
    "place",
    "duration_s",
    "flight_seed",
    "nees",
    "within_3_sigma",
    "looks",
    "valid",
    "coasted",
    "descended",
    "handed_over_at_s",
    "handed_over",
    "lost_at_s",
    "lost",
    "description",
];

/// Writes one row per flight.
pub(super) fn csv(out: &mut dyn Write, results: &RoughResults<'_>) -> io::Result<()> {
    let mut csv = csv::Writer::from_writer(out);
    csv.write_record(HEADS)?;
    for flown in results.flown {
        let (flight, judged) = (&flown.flight, &flown.judgement);
        let figure = |value: f64| if judged.valid > 0 { value.to_string() } else { String::new() };
        let none = || [String::new(), String::new()];
        let [tripped_at, tripped] =
            judged.tripped.map_or_else(none, |trip| [trip.time_s.to_string(), trip.reason.into()]);
        let [lost_at, lost] = judged.lost.map_or_else(none, |lost| [lost.time_s.to_string(), lost.reason.into()]);
        csv.write_record([
            flight.scenario.name.clone(),
            flight.vehicle.clone(),
            flight.seed.to_string(),
            flight.number.to_string(),
            flight.class.into(),
            flight.parts.join(" "),
            flight.place.name().into(),
            flight.scenario.duration_s.to_string(),
            flight.scenario.seed.to_string(),
            figure(judged.nees),
            figure(judged.within),
            judged.looks.to_string(),
            judged.valid.to_string(),
            judged.coasted.to_string(),
            judged.descended.to_string(),
            tripped_at,
            tripped,
            lost_at,
            lost,
            flight.scenario.description.clone(),
        ])?;
    }
    csv.flush()
}

#[derive(Serialize)]
struct RoughSuiteJson<'a> {
    suite: &'static str,
    first_seed: u64,
    seeds: u64,
    flights_per_vehicle_and_class: u64,
    duration_s: Option<f64>,
    vehicles: Vec<&'a str>,
    contender: Option<&'a str>,
    classes: Vec<ClassJson>,
}

#[derive(Serialize)]
struct ClassJson {
    /// Name of the class; null for all flights.
    class: Option<&'static str>,
    meaning: Option<&'static str>,
    known: Option<bool>,
    flights: usize,
    nees: f64,
    worst_nees: f64,
    within_3_sigma: f64,
    valid_ratio: f64,
    coasted: usize,
    descended: usize,
    handed_over: usize,
    lost: usize,
}

/// Writes one JSON object with a row for each class.
///
/// # Errors
/// Fails if writing to `out` fails.
pub fn json(out: &mut dyn Write, results: &RoughResults<'_>) -> io::Result<()> {
    let rough = results.rough;
    let whole = RoughSuiteJson {
        suite: NAME,
        first_seed: rough.seeds.start,
        seeds: rough.seeds.end - rough.seeds.start,
        flights_per_vehicle_and_class: rough.flights,
        duration_s: rough.duration_s,
        vehicles: rough.vehicles.iter().map(|vehicle| vehicle.name.as_str()).collect(),
        contender: cells::contender(results).map(|contender| contender.name.as_str()),
        classes: results.rows.iter().map(words).collect(),
    };
    serde_json::to_writer_pretty(&mut *out, &whole)?;
    writeln!(out)
}

fn words(row: &ClassRow) -> ClassJson {
    let class = CLASSES.iter().find(|class| Some(class.name) == row.class);
    ClassJson {
        class: row.class,
        meaning: row.class.map(|_| class.map_or(MIXTURE_MEANING, |class| class.meaning)),
        known: row.class.map(|_| class.is_some_and(|class| class.known)),
        flights: row.flights,
        nees: row.nees,
        worst_nees: row.worst_nees,
        within_3_sigma: row.within,
        valid_ratio: row.valid,
        coasted: row.coasted,
        descended: row.descended,
        handed_over: row.tripped,
        lost: row.lost,
    }
}

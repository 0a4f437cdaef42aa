//! Writes `flights.csv` and `random.json`.

use super::RandomResults;
use super::results::VehicleGroup;
use crate::words::measured;
use afbc_campaign::compare::FlightOutcome;
use afbc_campaign::random::{Ranking, is_level};
use serde::Serialize;
use std::io::{self, Write};

/// Columns that describe the flight.
const FLIGHT: [&str; 10] = [
    "flight",
    "vehicle",
    "seed",
    "number",
    "path",
    "from_ground",
    "speed_m_s",
    "acceleration_m_s2",
    "change",
    "description",
];
/// Columns that describe the contender and its result.
const FLOWN: [&str; 10] = [
    "contender",
    "controller",
    "rms_m",
    "largest_m",
    "rmse_psi_rad",
    "best_or_level",
    "lost_at_s",
    "lost",
    "tripped_at_s",
    "trip",
];

/// Writes one row per flight of each contender. A lost flight's figures cover the time until the loss.
pub(super) fn csv(out: &mut dyn Write, judged: &RandomResults<'_>) -> io::Result<()> {
    let mut csv = csv::Writer::from_writer(out);
    csv.write_record(FLIGHT.into_iter().chain(FLOWN))?;
    for flown in judged.flown {
        let (flight, best_m) = (&flown.flight, flown.score().best_m());
        let what = [
            flight.scenario.name.clone(),
            flight.vehicle.clone(),
            flight.seed.to_string(),
            flight.number.to_string(),
            flight.path.into(),
            flight.stands.to_string(),
            flight.speed_m_s.to_string(),
            flight.acceleration_m_s2.to_string(),
            flight.change.kind().into(),
            flight.scenario.description.clone(),
        ];
        for (contender, outcome) in judged.contenders().iter().zip(&flown.outcomes) {
            let FlightOutcome { lost, tripped, metrics, .. } = outcome;
            let rms_m = metrics.rmse.xyz().norm();
            let level = lost.is_none() && best_m.is_some_and(|best_m| is_level(rms_m, best_m));
            let none = || [String::new(), String::new()];
            let [lost_at, lost] = lost.map_or_else(none, |lost| [lost.time_s.to_string(), lost.reason.into()]);
            let [tripped_at, trip] = tripped.map_or_else(none, |trip| [trip.time_s.to_string(), trip.reason.into()]);
            let how = [
                contender.name.clone(),
                contender.kind().name().into(),
                measured(metrics, rms_m),
                measured(metrics, metrics.max_distance_m),
                measured(metrics, metrics.rmse.w),
                level.to_string(),
                lost_at,
                lost,
                tripped_at,
                trip,
            ];
            csv.write_record(what.iter().chain(&how))?;
        }
    }
    csv.flush()
}

#[derive(Serialize)]
struct RandomSuiteJson<'a> {
    suite: &'static str,
    first_seed: u64,
    seeds: u64,
    flights_per_vehicle: u64,
    sensors: &'static str,
    against: &'a str,
    groups: Vec<VehicleGroupJson<'a>>,
}

#[derive(Serialize)]
struct VehicleGroupJson<'a> {
    /// Name of the vehicle; null for all vehicles together.
    vehicle: Option<&'a str>,
    flights: usize,
    lost_by_all: &'a [&'a str],
    contenders: Vec<RankedContenderJson<'a>>,
}

#[derive(Serialize)]
struct RankedContenderJson<'a> {
    name: &'a str,
    controller: &'static str,
    best_or_level: usize,
    best_or_level_ratio: f64,
    lost: usize,
    lost_alone: usize,
    median_m: Option<f64>,
    geometric_mean_m: Option<f64>,
    log_difference: Option<PairedJson>,
}

#[derive(Serialize)]
struct PairedJson {
    flights: usize,
    mean: f64,
    interval_95: Option<[f64; 2]>,
    p: f64,
    p_holm: f64,
    rank_biserial: f64,
}

/// Writes one JSON object: the contenders' ranking on each vehicle and on all together.
///
/// # Errors
/// Fails if writing to `out` fails.
pub fn json(out: &mut dyn Write, judged: &RandomResults<'_>) -> io::Result<()> {
    let random = judged.random;
    let whole = RandomSuiteJson {
        suite: afbc_campaign::random::NAME,
        first_seed: random.seeds.start,
        seeds: random.seeds.end - random.seeds.start,
        flights_per_vehicle: random.flights,
        sensors: random.seen.scenario(),
        against: judged.baseline_name(),
        groups: judged.groups.iter().map(|group| of_group(judged, group)).collect(),
    };
    serde_json::to_writer_pretty(&mut *out, &whole)?;
    writeln!(out)
}

fn of_group<'a>(judged: &RandomResults<'a>, group: &'a VehicleGroup<'a>) -> VehicleGroupJson<'a> {
    let words = |(contender, ranking): (&'a afbc_scenario::contender::Contender, &Ranking)| {
        let Ranking { wins, lost, lost_alone, median_m, geometric_m, difference } = *ranking;
        RankedContenderJson {
            name: &contender.name,
            controller: contender.kind().name(),
            best_or_level: wins,
            best_or_level_ratio: wins as f64 / group.kept().max(1) as f64,
            lost,
            lost_alone,
            median_m,
            geometric_mean_m: geometric_m,
            log_difference: difference.map(|difference| PairedJson {
                flights: difference.flights,
                mean: difference.mean,
                interval_95: difference.interval,
                p: difference.test.p,
                p_holm: difference.p_holm,
                rank_biserial: difference.test.effect,
            }),
        }
    };
    VehicleGroupJson {
        vehicle: group.vehicle,
        flights: group.flights,
        lost_by_all: &group.lost_by_all,
        contenders: judged.contenders().iter().zip(&group.rankings).map(words).collect(),
    }
}

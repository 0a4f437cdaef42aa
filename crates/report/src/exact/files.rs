//! Writes `change.csv` and `summary.json`.

use super::cells::{problem, quantities};
use super::replayed::ReplayedLog;
use afbc_replay::exact::{ChangeComparison, ExactReplay, SettingChange};
use serde::Serialize;
use std::io::{self, Write};

/// Writes the commands over time, as flown and under the changed settings; a field without a value is empty.
pub(super) fn csv(out: &mut dyn Write, replay: &ExactReplay) -> io::Result<()> {
    let mut csv = csv::Writer::from_writer(out);
    let columns: Vec<_> = quantities(replay).collect();
    let names = columns.iter().map(|(_, quantity)| quantity.name.to_owned());
    let changed = columns.iter().map(|(_, quantity)| format!("changed_{}", quantity.name));
    csv.write_record(std::iter::once("time_s".to_owned()).chain(names).chain(changed))?;
    for row in replay.comparison.iter().flat_map(|comparison| &comparison.rows) {
        let of = |values: &[f32], index: usize| {
            let value = values.get(index).copied().filter(|value| value.is_finite());
            value.map_or(String::new(), |value| value.to_string())
        };
        let flown = columns.iter().map(|(index, _)| of(&row.flown, *index));
        let changed = columns.iter().map(|(index, _)| of(&row.changed, *index));
        csv.write_record(std::iter::once(format!("{:.6}", row.time_s)).chain(flown).chain(changed))?;
    }
    csv.flush()
}

#[derive(Serialize)]
struct ExactReplayJson<'a> {
    log: &'a str,
    vehicle: &'a str,
    law: &'a str,
    rotors: usize,
    starts: u32,
    ticks: u64,
    armed_ticks: u64,
    flights: u32,
    lost_ticks: u64,
    messages: u64,
    bytes: u64,
    damaged_frames: u64,
    cut_bytes: usize,
    parameters: Vec<ParameterJson<'a>>,
    same_ticks: u64,
    is_same: bool,
    problem: Option<String>,
    first_different_tick: Option<u32>,
    first_different_start: Option<u32>,
    change: Option<ChangedJson>,
}

#[derive(Serialize)]
struct ParameterJson<'a> {
    name: Option<&'a str>,
    value: f32,
    at_s: Option<f64>,
}

#[derive(Serialize)]
struct ChangedJson {
    settings: Vec<String>,
    other_mode_ticks: u64,
    other_mode_from_s: Option<f64>,
    differences: Vec<DifferenceJson>,
}

#[derive(Serialize)]
struct DifferenceJson {
    name: &'static str,
    unit: &'static str,
    ticks: u64,
    rms: Option<f64>,
    largest: Option<f64>,
    largest_at_s: Option<f64>,
}

/// Writes the summary as one JSON object.
///
/// # Errors
/// Fails if writing to `out` fails.
pub fn json(out: &mut dyn Write, log: &ReplayedLog<'_>) -> io::Result<()> {
    let ReplayedLog { name, replay } = log;
    let first = replay.first_difference.as_ref();
    let parameters = replay.parameters.iter();
    let summary = ExactReplayJson {
        log: name,
        vehicle: &replay.vehicle,
        law: &replay.law,
        rotors: replay.rotors,
        starts: replay.starts,
        ticks: replay.ticks,
        armed_ticks: replay.armed_ticks,
        flights: replay.flights,
        lost_ticks: replay.lost_ticks,
        messages: replay.messages,
        bytes: replay.bytes,
        damaged_frames: replay.damaged.0,
        cut_bytes: replay.cut_bytes,
        parameters: parameters
            .map(|it| ParameterJson { name: it.name.as_deref(), value: it.value, at_s: it.at_s })
            .collect(),
        same_ticks: replay.same_ticks,
        is_same: replay.is_same(),
        problem: problem(log),
        first_different_tick: first.map(|first| first.tick),
        first_different_start: first.map(|first| first.start),
        change: replay.comparison.as_ref().map(|comparison| changed(replay, comparison)),
    };
    serde_json::to_writer_pretty(&mut *out, &summary)?;
    writeln!(out)
}

fn changed(replay: &ExactReplay, comparison: &ChangeComparison) -> ChangedJson {
    let differences = quantities(replay).map(|(index, quantity)| {
        let figure = comparison.figures.get(index).copied().unwrap_or_default();
        let rms = figure.rms();
        DifferenceJson {
            name: quantity.name,
            unit: quantity.unit,
            ticks: figure.count,
            rms,
            largest: rms.map(|_| figure.largest),
            largest_at_s: rms.filter(|_| figure.largest > 0.0).map(|_| figure.largest_at_s),
        }
    });
    ChangedJson {
        settings: comparison.changes.iter().map(SettingChange::to_string).collect(),
        other_mode_ticks: comparison.other_mode,
        other_mode_from_s: comparison.other_mode_s,
        differences: differences.collect(),
    }
}

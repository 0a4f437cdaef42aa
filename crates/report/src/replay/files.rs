//! Writes `replay.csv` and `summary.json`.

use super::{ReplayedRecording, cells};
use afbc_estimator::Estimate;
use afbc_replay::{EstimatorStart, Figures, LoggedState, ReplayRow};
use afbc_types::State;
use nalgebra::{Quaternion, Vector3};
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::{self, Write};

/// Columns of an estimate, ours or the log's.
const PARTS: [&str; 9] = ["x_m", "y_m", "z_m", "vx_m_s", "vy_m_s", "vz_m_s", "roll_rad", "pitch_rad", "yaw_rad"];
/// Columns of our standard deviations: position, velocity, rotation about the axes of the earth frame.
const SIGMAS: [&str; 9] = [
    "x_sigma_m",
    "y_sigma_m",
    "z_sigma_m",
    "vx_sigma_m_s",
    "vy_sigma_m_s",
    "vz_sigma_m_s",
    "rx_sigma_rad",
    "ry_sigma_rad",
    "rz_sigma_rad",
];

/// Returns the column names after the time: our estimate, its standard deviations, the log's estimate.
fn head() -> impl Iterator<Item = String> {
    let logged = PARTS.iter().map(|part| format!("logged_{part}"));
    PARTS.iter().chain(&SIGMAS).map(|name| (*name).to_owned()).chain(logged)
}

/// Returns a row's values, in the order of [`head`].
fn fields(row: &ReplayRow) -> impl Iterator<Item = Option<f32>> {
    let ours = row.ours.as_ref();
    ours_of(ours).into_iter().chain(sigmas_of(ours)).chain(logged_of(&row.logged))
}

/// Returns the columns of the CSV file with their values; NaN marks a missing value.
pub fn columns(rows: &[ReplayRow]) -> Vec<(String, Vec<f64>)> {
    let time_s = ("time_s".to_owned(), rows.iter().map(|row| row.time_s).collect());
    let column = |(i, name)| {
        let value = |row| fields(row).nth(i).flatten().map_or(f64::NAN, f64::from);
        (name, rows.iter().map(value).collect())
    };
    std::iter::once(time_s).chain(head().enumerate().map(column)).collect()
}

/// Writes both estimates over time; a missing value gives an empty field.
pub(super) fn csv(out: &mut dyn Write, replay: &ReplayedRecording<'_>) -> io::Result<()> {
    let mut csv = csv::Writer::from_writer(out);
    csv.write_record(std::iter::once("time_s".to_owned()).chain(head()))?;
    for row in &replay.replayed.rows {
        let text = |value: Option<f32>| value.map_or(String::new(), |value| value.to_string());
        csv.write_record(std::iter::once(format!("{:.6}", row.time_s)).chain(fields(row).map(text)))?;
    }
    csv.flush()
}

fn three(v: Option<&Vector3<f32>>) -> [Option<f32>; 3] {
    v.map_or([None; 3], |v| [v.x, v.y, v.z].map(Some))
}

fn ours_of(ours: Option<&Estimate>) -> [Option<f32>; 9] {
    let state = ours.map(|ours| &ours.state);
    joined(
        state.map(|state| &state.position_m),
        state.map(|state| &state.velocity_m_s),
        state.map(|state| &state.attitude_rad),
    )
}

fn sigmas_of(ours: Option<&Estimate>) -> [Option<f32>; 9] {
    let sigmas = ours.map(|ours| &ours.sigmas);
    joined(
        sigmas.map(|sigmas| &sigmas.position_m),
        sigmas.map(|sigmas| &sigmas.velocity_m_s),
        sigmas.map(|sigmas| &sigmas.attitude_rad),
    )
}

fn logged_of(logged: &LoggedState) -> [Option<f32>; 9] {
    let zero = Vector3::zeros();
    let attitude = logged.attitude.and_then(|[w, x, y, z]| {
        State::from_quaternion(zero, zero, &Quaternion::new(w, x, y, z), zero).map(|state| state.attitude_rad)
    });
    joined(logged.position_m.as_ref(), logged.velocity_m_s.as_ref(), attitude.as_ref())
}

fn joined(
    position: Option<&Vector3<f32>>,
    velocity: Option<&Vector3<f32>>,
    attitude: Option<&Vector3<f32>>,
) -> [Option<f32>; 9] {
    let ([x, y, z], [vx, vy, vz], [roll, pitch, yaw]) = (three(position), three(velocity), three(attitude));
    [x, y, z, vx, vy, vz, roll, pitch, yaw]
}

#[derive(Serialize)]
struct ReplayJson<'a> {
    log: &'a str,
    format: &'a str,
    duration_s: f64,
    imu_rate_hz: f64,
    declination_deg: f64,
    sources: Vec<SourceJson<'a>>,
    missing: Vec<&'a str>,
    unusable: Vec<&'a str>,
    notes: &'a [String],
    start: &'static str,
    started_at_s: Option<f64>,
    start_reason: Option<String>,
    measured_from_s: Option<f64>,
    attitude_rms_deg: Option<f64>,
    tilt_rms_deg: Option<f64>,
    heading_rms_deg: Option<f64>,
    velocity_rms_m_s: Option<f64>,
    position_rms_m: Option<f64>,
    horizontal_rms_m: Option<f64>,
    height_rms_m: Option<f64>,
    largest: LargestJson,
    within_3_sigma_ratio: PartsJson,
    valid_ratio: PartsJson,
    aids: Vec<AidJson>,
    resets: BTreeMap<&'static str, u32>,
    logged_resets: Vec<ResetJson>,
}

#[derive(Serialize)]
struct SourceJson<'a> {
    sensor: &'a str,
    topic: &'a str,
    used: usize,
    skipped: usize,
}

#[derive(Serialize)]
struct LargestJson {
    attitude_deg: Option<f64>,
    velocity_m_s: Option<f64>,
    position_m: Option<f64>,
}

#[derive(Serialize)]
struct PartsJson {
    attitude: Option<f64>,
    velocity: Option<f64>,
    position: Option<f64>,
}

impl PartsJson {
    fn of(figures: &Figures, part: fn(&afbc_replay::ErrorFigure) -> Option<f64>) -> Self {
        let Figures { attitude, velocity, position, .. } = figures;
        PartsJson { attitude: part(attitude), velocity: part(velocity), position: part(position) }
    }
}

#[derive(Serialize)]
struct AidJson {
    name: &'static str,
    fused: u32,
    rejected: u32,
}

#[derive(Serialize)]
struct ResetJson {
    at_s: f64,
    what: &'static str,
    by: Option<f64>,
    unit: &'static str,
}

/// Writes the summary as one JSON object.
///
/// # Errors
/// Fails if writing to `out` fails.
pub fn json(out: &mut dyn Write, replay: &ReplayedRecording<'_>) -> io::Result<()> {
    let ReplayedRecording { name, recording, replayed } = replay;
    let (start, started_at_s, start_reason) = match replayed.start {
        EstimatorStart::AtRest(at_s) => ("at-rest", Some(at_s), None),
        EstimatorStart::FromLog(at_s, None) => ("from-log", Some(at_s), Some("the vehicle was in the air".to_owned())),
        EstimatorStart::FromLog(at_s, Some(why)) => ("from-log", Some(at_s), Some(why.to_string())),
        EstimatorStart::Never(why) => ("never", None, Some(why.to_string())),
    };
    let figures = &replayed.figures;
    let largest = |figure: &afbc_replay::ErrorFigure| figure.rms().map(|_| figure.largest);
    let first_us = recording.imu.first().map_or(0, |sample| sample.at_us);
    let resets = &replayed.resets;
    let summary = ReplayJson {
        log: name,
        format: recording.format,
        duration_s: recording.duration_s(),
        imu_rate_hz: recording.imu_rate_hz(),
        declination_deg: f64::from(recording.declination_rad).to_degrees(),
        sources: recording
            .sources
            .iter()
            .map(|it| SourceJson { sensor: it.sensor.title(), topic: &it.topic, used: it.used, skipped: it.skipped })
            .collect(),
        missing: recording.missing().map(|source| source.topic.as_str()).collect(),
        unusable: recording.unusable().map(|source| source.topic.as_str()).collect(),
        notes: &recording.notes,
        start,
        started_at_s,
        start_reason,
        measured_from_s: started_at_s.map(|_| replayed.from_s),
        attitude_rms_deg: figures.attitude.rms(),
        tilt_rms_deg: figures.tilt.rms(),
        heading_rms_deg: figures.heading.rms(),
        velocity_rms_m_s: figures.velocity.rms(),
        position_rms_m: figures.position.rms(),
        horizontal_rms_m: figures.horizontal.rms(),
        height_rms_m: figures.height.rms(),
        largest: LargestJson {
            attitude_deg: largest(&figures.attitude),
            velocity_m_s: largest(&figures.velocity),
            position_m: largest(&figures.position),
        },
        within_3_sigma_ratio: PartsJson::of(figures, afbc_replay::ErrorFigure::within_ratio),
        valid_ratio: PartsJson::of(figures, afbc_replay::ErrorFigure::valid_ratio),
        aids: cells::AIDS
            .iter()
            .map(|(name, aid)| {
                let record = replayed.aids.of(*aid);
                AidJson { name, fused: record.accepted, rejected: record.rejected }
            })
            .collect(),
        resets: BTreeMap::from([
            ("position", resets.position),
            ("velocity", resets.velocity),
            ("heading", resets.heading),
            ("height", resets.height),
            ("tilt", resets.tilt),
            ("covariance", resets.covariance),
            ("restarts", resets.restarts),
        ]),
        logged_resets: recording
            .resets
            .iter()
            .map(|reset| ResetJson {
                at_s: (reset.at_us as f64 - first_us as f64) * 1e-6,
                what: reset.what,
                by: Some(reset.by).filter(|by| by.is_finite()),
                unit: reset.unit,
            })
            .collect(),
    };
    serde_json::to_writer_pretty(&mut *out, &summary)?;
    writeln!(out)
}

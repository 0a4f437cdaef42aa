//! Texts and numbers about a replay, for the HTML page and the terminal.

use super::ReplayedRecording;
use afbc_estimator::{AidSource, Resets};
use afbc_replay::{ErrorFigure, EstimatorStart, SampleSource};

/// Column heads.
pub(super) const HEADS: [&str; 4] = ["RMS", "largest", "within 3σ", "valid"];
/// Largest number of resets of the log that are listed.
const RESETS_MAX: usize = 12;

/// Differences of one quantity.
pub(super) struct ReplayTableRow {
    pub(super) name: &'static str,
    pub(super) cells: [String; 4],
}

/// Returns the differences; "-" if nothing could be compared.
pub(super) fn rows(replay: &ReplayedRecording<'_>) -> Vec<ReplayTableRow> {
    let f = &replay.replayed.figures;
    let number = |value: Option<f64>, unit: &str| value.map_or("-".into(), |value| format!("{value:.3} {unit}"));
    let percent = |share: Option<f64>| share.map_or("-".into(), |share| format!("{:.1} %", 100.0 * share));
    let row = |name, figure: &ErrorFigure, unit: &str| ReplayTableRow {
        name,
        cells: [
            number(figure.rms(), unit),
            number(figure.rms().map(|_| figure.largest), unit),
            percent(figure.within_ratio()),
            percent(figure.valid_ratio()),
        ],
    };
    vec![
        row("attitude", &f.attitude, "°"),
        row("  tilt", &f.tilt, "°"),
        row("  heading", &f.heading, "°"),
        row("velocity", &f.velocity, "m/s"),
        row("position", &f.position, "m"),
        row("  horizontal", &f.horizontal, "m"),
        row("  height", &f.height, "m"),
    ]
}

/// Summarises the log: "PX4 ULog, 31.1 s, inertial sensor at 250 Hz".
pub(super) fn conditions(replay: &ReplayedRecording<'_>) -> String {
    let recording = replay.recording;
    let (length_s, rate_hz) = (recording.duration_s(), recording.imu_rate_hz());
    format!("{}, {length_s:.1} s, inertial sensor at {rate_hz:.0} Hz", recording.format)
}

/// Describes the data used and the course of the replay, one sentence per fact.
pub(super) fn sentences(replay: &ReplayedRecording<'_>) -> Vec<String> {
    let (recording, replayed) = (replay.recording, replay.replayed);
    let used = recording.sources.iter().filter(|source| source.used > 0).map(|source| {
        let skipped = if source.skipped > 0 { format!(", {} not used", source.skipped) } else { String::new() };
        format!("{} {} ({}{skipped})", source.used, source.sensor.title(), source.topic)
    });
    let mut said = vec![format!("Used: {}.", used.collect::<Vec<_>>().join("; "))];
    let listed = |sources: Vec<&SampleSource>| {
        let words = sources.iter().map(|source| format!("{} ({})", source.sensor.title(), source.topic));
        words.collect::<Vec<_>>().join("; ")
    };
    let (missing, unusable) = (recording.missing().collect::<Vec<_>>(), recording.unusable().collect::<Vec<_>>());
    if !missing.is_empty() {
        said.push(format!("Missing: {}.", listed(missing)));
    }
    if !unusable.is_empty() {
        said.push(format!("Logged, but never valid: {}.", listed(unusable)));
    }
    said.extend(recording.notes.iter().cloned());
    let rate_hz = recording.imu_rate_hz();
    if rate_hz < 90.0 {
        said.push(format!(
            "The inertial sensor was logged at {rate_hz:.0} Hz, but the estimator needs 100 Hz: the missing \
             samples also increase the errors shown here."
        ));
    }
    said.push(start(replay));
    if let Some(by) = replayed.moved_m {
        said.push(format!(
            "The log does not state the origin of its positions: they were moved by ({:.1}, {:.1}, {:.1}) m to agree \
             with the estimate at the first time compared.",
            by.x, by.y, by.z
        ));
    }
    let Resets { position, velocity, heading, height, tilt, covariance, restarts } = replayed.resets;
    said.push(format!(
        "Number of resets by the estimator: position {position}, velocity {velocity}, heading {heading}, barometer's \
         offset {height}, tilt variance {tilt}, covariance {covariance}, restarts {restarts}."
    ));
    let rejected = AIDS.iter().filter_map(|(name, aid)| {
        let record = replayed.aids.of(*aid);
        (record.rejected > 0).then(|| format!("{name} {} of {}", record.rejected, record.rejected + record.accepted))
    });
    let rejected: Vec<_> = rejected.collect();
    if !rejected.is_empty() {
        said.push(format!("Rejected by the gates: {}.", rejected.join(", ")));
    }
    let dropped = &replayed.dropped;
    if dropped.disturbed > 0 {
        said.push(format!(
            "{} magnetic field measurements differ from the field at the start, and were not used.",
            dropped.disturbed
        ));
    }
    if !recording.resets.is_empty() {
        let first_us = recording.imu.first().map_or(0, |sample| sample.at_us);
        let one = |reset: &afbc_replay::LoggedReset| {
            let by = if reset.by.is_finite() { format!(" by {:.3} {}", reset.by, reset.unit) } else { String::new() };
            format!("{}{by} at {:.1} s", reset.what, (reset.at_us as f64 - first_us as f64) * 1e-6)
        };
        let all: Vec<_> = recording.resets.iter().take(RESETS_MAX).map(one).collect();
        let more = recording.resets.len() - all.len();
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        said.push(format!(
            "The log's own estimate was reset: {}{more}. The differences include these resets.",
            all.join(", ")
        ));
    }
    said
}

/// Names of the measurements.
pub(super) const AIDS: [(&str, AidSource); 5] = [
    ("gnss-position", AidSource::GnssPosition),
    ("gnss-height", AidSource::GnssHeight),
    ("gnss-velocity", AidSource::GnssVelocity),
    ("height", AidSource::Height),
    ("heading", AidSource::Heading),
];

fn start(replay: &ReplayedRecording<'_>) -> String {
    let from_s = replay.replayed.from_s;
    match replay.replayed.start {
        EstimatorStart::AtRest(at_s) => {
            format!("The estimator started at rest after {at_s:.1} s; compared from {from_s:.1} s on.")
        }
        EstimatorStart::FromLog(at_s, None) => format!(
            "The vehicle was in the air, so the estimator started at {at_s:.1} s from the log's own state; compared \
             from {from_s:.1} s on."
        ),
        EstimatorStart::FromLog(at_s, Some(why)) => format!(
            "The estimator did not start by itself ({why}). It was started at {at_s:.1} s from the log's own state; \
             compared from {from_s:.1} s on."
        ),
        EstimatorStart::Never(why) => {
            format!("The estimator never started ({why}), and the log has no attitude to start from.")
        }
    }
}

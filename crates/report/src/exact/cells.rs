//! Texts and numbers about a replayed exact log, for the HTML page and the terminal.

use super::replayed::ReplayedLog;
use crate::table::wrap;
use afbc_replay::exact::{
    ChangeComparison, ExactReplay, FirstDifference, GivenSignal, LoggedParameter, QUANTITIES, ReplayFinding,
    ReplayQuantity, SettingChange,
};

/// Column heads.
pub(super) const HEADS: [&str; 3] = ["RMS", "largest", "at"];
/// Largest number of parameters that are listed.
const LISTED_MAX: usize = 40;
/// Ticks per second.
const RATE_HZ: f64 = 1000.0;

/// Difference of one quantity between the two settings.
pub(super) struct ExactRow {
    pub(super) name: &'static str,
    pub(super) cells: [String; 3],
}

/// Returns the quantities that this vehicle has, with their indices in [`QUANTITIES`].
pub(crate) fn quantities(replay: &ExactReplay) -> impl Iterator<Item = (usize, &'static ReplayQuantity)> {
    let rotors = replay.rotors;
    QUANTITIES.iter().enumerate().filter(move |(_, quantity)| quantity.rotor.is_none_or(|rotor| rotor < rotors))
}

/// Returns how far each quantity differs under the changed settings; "-" if nothing could be compared.
pub(super) fn rows(replay: &ExactReplay, comparison: &ChangeComparison) -> Vec<ExactRow> {
    let row = |(index, quantity): (usize, &ReplayQuantity)| {
        let figure = comparison.figures.get(index).copied().unwrap_or_default();
        let cells = match figure.rms() {
            None => ["-".into(), "-".into(), "-".into()],
            Some(rms) if figure.largest == 0.0 => [format!("{rms:.4} {}", quantity.unit), "-".into(), "-".into()],
            Some(rms) => [
                format!("{rms:.4} {}", quantity.unit),
                format!("{:.4} {}", figure.largest, quantity.unit),
                format!("{:.3} s", figure.largest_at_s),
            ],
        };
        ExactRow { name: quantity.title, cells }
    };
    quantities(replay).map(row).collect()
}

/// Summarises the log: "paper under afbc, 25000 ticks (25.0 s), 75 bytes per tick".
pub(super) fn conditions(replay: &ExactReplay) -> String {
    let ExactReplay { vehicle, law, ticks, bytes, .. } = replay;
    let per_tick = *bytes as f64 / (*ticks).max(1) as f64;
    format!("{vehicle} under {law}, {ticks} ticks ({:.1} s), {per_tick:.0} bytes per tick", *ticks as f64 / RATE_HZ)
}

/// Describes the contents of the log, one sentence per fact.
pub(super) fn contents(replay: &ExactReplay) -> Vec<String> {
    let ExactReplay { starts, armed_ticks, flights, lost_ticks, messages, parameters, damaged, cut_bytes, .. } = replay;
    let armed_s = *armed_ticks as f64 / RATE_HZ;
    let mut said = vec![format!(
        "{}, armed {} for {armed_s:.1} s together, {}, {}.",
        counted(*starts, "start"),
        if *flights == 1 { "once".into() } else { format!("{flights} times") },
        if *messages == 1 { "1 record of messages".into() } else { format!("{messages} records of messages") },
        if *lost_ticks == 0 { "no tick lost".into() } else { format!("{} lost", counted(*lost_ticks, "tick")) },
    )];
    let (first, later): (Vec<_>, Vec<_>) = parameters.iter().partition(|parameter| parameter.at_s.is_none());
    if !first.is_empty() {
        said.push(format!("Parameters that differ from the image: {}.", listed(&first)));
    }
    if !later.is_empty() {
        said.push(format!("Parameters changed later: {}.", listed(&later)));
    }
    if let (count, Some(at)) = damaged {
        said.push(format!("{} cannot be read; the first is at byte {at}.", counted(*count, "frame")));
    }
    if *cut_bytes > 0 {
        said.push(format!("The log ends within a frame; {cut_bytes} bytes of that frame are left."));
    }
    said
}

fn counted(count: impl Into<u64>, what: &str) -> String {
    let count = count.into();
    if count == 1 { format!("1 {what}") } else { format!("{count} {what}s") }
}

fn listed(parameters: &[&LoggedParameter]) -> String {
    let one = |parameter: &&LoggedParameter| {
        let what = parameter
            .name
            .as_ref()
            .map_or("all parameters are as in the image".into(), |name| format!("{name} = {}", parameter.value));
        parameter.at_s.map_or(what.clone(), |at_s| format!("{what} at {at_s:.1} s"))
    };
    let all: Vec<_> = parameters.iter().take(LISTED_MAX).map(one).collect();
    let more = parameters.len() - all.len();
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!("{}{more}", all.join(", "))
}

/// Says whether the replay gives the same results as the log.
pub(super) fn verdict(replay: &ExactReplay) -> String {
    match &replay.first_difference {
        None if replay.damaged.0 > 0 => {
            format!("All {} readable ticks give the same results again, to the last bit.", replay.same_ticks)
        }
        None => format!("All {} ticks give the same results again, to the last bit.", replay.same_ticks),
        Some(first) => {
            let same = format!("{} ticks give the same results again, to the last bit", replay.same_ticks);
            format!("{same}; then {}.", different(replay, first))
        }
    }
}

/// Describes the first difference and its place in the log.
fn different(replay: &ExactReplay, first: &FirstDifference) -> String {
    let FirstDifference { start, tick, at_s, byte, finding } = first;
    let start = if replay.starts > 1 { format!(" of start {start}") } else { String::new() };
    let place = format!("tick {tick}{start}");
    match finding {
        ReplayFinding::Given(signals) => {
            let signals: Vec<_> = signals.iter().map(signal).collect();
            format!("{place} at {at_s:.3} s (byte {byte}) gives another result: {}", signals.join(", "))
        }
        ReplayFinding::Missing => format!("{place}, after {at_s:.3} s (byte {byte}), is missing"),
        ReplayFinding::Configuration => {
            format!("{place} at {at_s:.3} s (byte {byte}) flies with parameters that the log lacks")
        }
        ReplayFinding::Parameter => {
            format!("a parameter before {place} (byte {byte}) is unknown, or the vehicle cannot fly with its value")
        }
    }
}

fn signal(signal: &GivenSignal) -> String {
    match signal {
        GivenSignal::Mode { then, now } => format!("mode {now} instead of {then}"),
        GivenSignal::Estimate => "the estimate".into(),
        GivenSignal::Speeds => "the rotor speeds".into(),
        GivenSignal::Throttle { motor, then, now } => format!("throttle {motor}: {now} instead of {then}"),
    }
}

/// Returns a line that says what is wrong with the log and what to do; `None` if every tick gives the same results.
#[must_use]
pub fn problem(log: &ReplayedLog<'_>) -> Option<String> {
    let replay = log.replay;
    let (damaged, at) = replay.damaged;
    let cure = match &replay.first_difference {
        None if damaged == 0 => return None,
        Some(FirstDifference { finding: ReplayFinding::Given(_), .. }) if damaged == 0 => {
            "replay the log with the program version that flew it; if the result still differs, this is a bug"
        }
        Some(FirstDifference { finding: ReplayFinding::Parameter, .. }) => {
            "replay the log with the program version that flew it"
        }
        _ => "the log has lost bytes: copy it again, or raise the baud rate of its link",
    };
    let damage = at.map_or(String::new(), |at| format!("byte {at}: {} damaged; ", counted(damaged, "frame")));
    let what = match &replay.first_difference {
        Some(first) => different(replay, first),
        None => "the content of the damaged frames is unknown".into(),
    };
    Some(format!("{damage}{what}; {cure}"))
}

/// Says which settings were changed, and how the flight core's mode differs.
pub(super) fn changed(comparison: &ChangeComparison) -> Vec<String> {
    let changes: Vec<_> = comparison.changes.iter().map(SettingChange::to_string).collect();
    let mut said = vec![format!(
        "Replayed from the same inputs with {}. The vehicle did not fly with these settings; its readings come from \
         the flight as flown.",
        changes.join(" and ")
    )];
    if let Some(at_s) = comparison.other_mode_s {
        let for_s = comparison.other_mode as f64 / RATE_HZ;
        said.push(format!(
            "With the changed settings, the flight core is in another mode for {for_s:.1} s, from {at_s:.3} s on."
        ));
    }
    said
}

/// Formats the whole result for the terminal.
#[must_use]
pub fn table(log: &ReplayedLog<'_>) -> String {
    let replay = log.replay;
    let mut lines = Vec::new();
    wrap(&mut lines, "", &format!("{}: {}.", log.name, conditions(replay)));
    for sentence in contents(replay) {
        wrap(&mut lines, "", &sentence);
    }
    wrap(&mut lines, "", &verdict(replay));
    if let Some(comparison) = &replay.comparison {
        lines.push(String::new());
        for sentence in changed(comparison) {
            wrap(&mut lines, "", &sentence);
        }
        lines.push(String::new());
        lines.extend(columns(&rows(replay, comparison)));
    }
    lines.push(String::new());
    lines.join("\n")
}

/// Returns the lines of the table.
fn columns(rows: &[ExactRow]) -> Vec<String> {
    let width = |text: &str| text.chars().count();
    let first = rows.iter().map(|row| width(row.name)).max().unwrap_or_default();
    let pad = |text: &str, to: usize| " ".repeat(to.saturating_sub(width(text)));
    let widths = [0, 1, 2].map(|column| {
        let cells = rows.iter().filter_map(|row| row.cells.get(column)).map(|cell| width(cell));
        cells.chain(HEADS.get(column).map(|head| width(head))).max().unwrap_or_default()
    });
    let line = |name: &str, cells: &mut dyn Iterator<Item = &str>| {
        let cells: String = cells.zip(widths).map(|(cell, to)| format!("  {}{cell}", pad(cell, to))).collect();
        format!("{name}{}{cells}", pad(name, first))
    };
    let head = line("", &mut HEADS.into_iter());
    let rule = "─".repeat(width(&head));
    let rows = rows.iter().map(|row| line(row.name, &mut row.cells.iter().map(String::as_str)));
    [rule.clone(), head].into_iter().chain(rows).chain([rule]).collect()
}

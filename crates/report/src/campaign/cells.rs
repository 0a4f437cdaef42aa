//! Contents of a campaign's table, for the HTML page and the terminal.

use afbc_campaign::statistics::{Share, percentile};
use afbc_campaign::{CampaignSummary, ContenderSummary, WorstFlight};
use afbc_sim::metrics::SETTLED_S;

/// Percentiles in the table.
pub(super) const PERCENTS: [f64; 3] = [50.0, 90.0, 99.0];

/// Column heads of the table, in groups.
pub(super) const HEADS: [(&str, &[&str]); 5] = [
    ("not lost", &["of all", "95 % interval"]),
    ("RMS distance [m]", &["median", "90 %", "99 %"]),
    ("largest [m]", &["median", "99 %"]),
    ("|ΔU₄| [mN]", &["median"]),
    ("fell back", &["of all"]),
];

/// Returns one row of the table, with one cell per column of [`HEADS`].
pub(super) fn cells(tally: &ContenderSummary) -> Vec<String> {
    let Share { value, low, high } = tally.count.share();
    let at = |values: &[f64], percent: f64, scale: f64, digits: usize| match percentile(values, percent) {
        None => "-".into(),
        Some(value) if value.is_finite() => format!("{:.digits$}", scale * value),
        Some(_) => "lost".into(),
    };
    let mut cells = vec![percent(value), format!("{:.2} to {:.2}", 100.0 * low, 100.0 * high)];
    cells.extend(PERCENTS.map(|percent| at(&tally.rmse_position_m, percent, 1.0, 5)));
    cells.extend([50.0, 99.0].map(|percent| at(&tally.max_position_m, percent, 1.0, 4)));
    cells.push(at(&tally.mean_abs_du4_n, 50.0, 1000.0, 1));
    cells.push(percent(tally.tripped as f64 / tally.count.flights as f64));
    cells
}

/// Formats a share as a percentage; "-" for NaN.
pub(super) fn percent(share: f64) -> String {
    if share.is_nan() { "-".into() } else { format!("{:.2} %", 100.0 * share) }
}

/// Returns the number of flights per contender; in a shard, the number of the shard.
pub(super) fn flights(summary: &CampaignSummary) -> u64 {
    summary.tallies.first().map_or(0, |tally| tally.count.flights)
}

/// Explains the columns in a few sentences.
pub(super) fn legend(summary: &CampaignSummary) -> String {
    let lost = summary.tallies.iter().any(|tally| tally.count.kept < tally.count.flights);
    let worse = " A lost flight ranks last; \"lost\" marks a percentile that falls on a lost flight.";
    let (worse, of) = if lost { (worse, ", of flights that were not lost") } else { ("", "") };
    format!(
        "Distances from the reference, from {SETTLED_S} s to the end.{worse} |ΔU₄|: mean absolute change of the thrust \
         command per control step{of}. Fell back: the contender's monitor switched to the fallback law. Percentiles \
         are nearest ranks, intervals Wilson's."
    )
}

/// Describes a bad flight and the command that repeats it. `target` is the campaign's name for `sitl campaign`.
pub(super) fn bad(target: &str, tally: &ContenderSummary, bad: &WorstFlight) -> [String; 2] {
    let how = match &bad.lost {
        Some((time_s, reason)) => format!("lost at t = {time_s:.3} s: {reason}"),
        None => match bad.rmse_position_m {
            Some(rmse_m) => format!("root mean square distance {rmse_m:.5} m"),
            None => format!("ended before errors count, from {SETTLED_S} s on"),
        },
    };
    let quoted = |text: &str| if text.contains(' ') { format!("\"{text}\"") } else { text.to_owned() };
    let command =
        format!("sitl campaign {} --flight {} --contender {}", quoted(target), bad.flight, quoted(&tally.contender));
    [format!("flight {}, {}: {how}", bad.flight, bad.trajectory), command]
}

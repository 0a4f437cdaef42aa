//! What a campaign leaves behind: table, summary, figures, report.

mod page;
mod summary;
mod table;

pub use summary::write as json;
pub use table::table;

use super::figures;
use afbc_campaign::statistics::{Share, percentile};
use afbc_campaign::{Bad, Summary, Tally};
use afbc_files::{Error, Folder};
use afbc_sim::metrics::SETTLED_S;
use std::path::PathBuf;

/// Writes everything about a campaign but its rows into `folder`, and returns the paths written:
///
/// * `position-error.svg`, `smoothness.svg`: distributions over all flights;
/// * `success.svg`: what losses hang on;
/// * `summary.json`: the same in numbers;
/// * `report.html`: all of it on one page that needs no other file.
///
/// # Errors
/// The first file that could not be written, or is somebody else's.
pub fn write(folder: &Folder, summary: &Summary) -> Result<Vec<PathBuf>, Error> {
    let figures = figures::campaign::draw(summary).map_err(|source| folder.error("figures", source))?;
    let svgs = figures.iter().map(|figure| format!("{}.svg", figure.name));
    folder.add(&svgs.chain(["summary.json".into(), "report.html".into()]).collect::<Vec<_>>())?;
    let mut paths = Vec::new();
    for figure in &figures {
        paths.push(folder.place(&format!("{}.svg", figure.name), |out| out.write_all(figure.svg.as_bytes()))?);
    }
    paths.push(folder.place("summary.json", |out| summary::write(out, summary))?);
    let page = page::page(summary, &figures);
    paths.push(folder.place("report.html", |out| out.write_all(page.as_bytes()))?);
    Ok(paths)
}

/// Percentiles that are reported.
const PERCENTS: [f64; 3] = [50.0, 90.0, 99.0];

/// Head of the table: a group of columns, and the columns in it.
const HEADS: [(&str, &[&str]); 5] = [
    ("not lost", &["of all", "95 % interval"]),
    ("RMS distance [m]", &["median", "90 %", "99 %"]),
    ("largest [m]", &["median", "99 %"]),
    ("|ΔU₄| [mN]", &["median"]),
    ("fell back", &["of all"]),
];

/// One line of the table: as many cells as [`HEADS`] has columns.
fn cells(tally: &Tally) -> Vec<String> {
    let Share { value, low, high } = tally.count.share();
    let at = |values: &[f64], percent: f64, scale: f64, digits: usize| match percentile(values, percent) {
        None => "-".into(),
        Some(value) if value.is_finite() => format!("{:.digits$}", scale * value),
        Some(_) => "lost".into(),
    };
    let mut cells = vec![percent(value), format!("{:.2} to {:.2}", 100.0 * low, 100.0 * high)];
    cells.extend(PERCENTS.map(|percent| at(&tally.rmse_position_m, percent, 1.0, 3)));
    cells.extend([50.0, 99.0].map(|percent| at(&tally.max_position_m, percent, 1.0, 3)));
    cells.push(at(&tally.mean_abs_du4_n, 50.0, 1000.0, 1));
    cells.push(percent(tally.tripped as f64 / tally.count.flights as f64));
    cells
}

/// A share for people; of nothing, none.
fn percent(share: f64) -> String {
    if share.is_nan() { "-".into() } else { format!("{:.2} %", 100.0 * share) }
}

/// How many flights each contender has made: of a shard, fewer than of the campaign.
fn flights(summary: &Summary) -> u64 {
    summary.tallies.first().map_or(0, |tally| tally.count.flights)
}

/// What the columns mean, in few sentences.
fn legend(summary: &Summary) -> String {
    let lost = summary.tallies.iter().any(|tally| tally.count.kept < tally.count.flights);
    let worse = " A lost flight is worse than any other: where a percentile is one, it says so.";
    let (worse, of) = if lost { (worse, ", of flights that were not lost") } else { ("", "") };
    format!(
        "Distances from the reference count from {SETTLED_S} s to the end.{worse} |ΔU₄|: mean jump of the thrust command from \
         one control step to the next{of}. Fell back: the contender's own monitor took another law. Percentiles are nearest \
         ranks, intervals Wilson's."
    )
}

/// How a bad flight went, and how to see it again; `target` is what `sitl campaign` knows the campaign by.
fn bad(target: &str, tally: &Tally, bad: &Bad) -> [String; 2] {
    let how = match &bad.lost {
        Some((time_s, reason)) => format!("lost at t = {time_s:.3} s: {reason}"),
        None => match bad.rmse_position_m {
            Some(rmse_m) => format!("{rmse_m:.3} m from the reference, root mean square"),
            None => format!("over before errors count, which is from {SETTLED_S} s on"),
        },
    };
    let quoted = |text: &str| if text.contains(' ') { format!("\"{text}\"") } else { text.to_owned() };
    let command =
        format!("sitl campaign {} --flight {} --contender {}", quoted(target), bad.flight, quoted(&tally.contender));
    [format!("flight {}, {}: {how}", bad.flight, bad.trajectory), command]
}

//! What a comparison leaves behind: table, CSV, JSON, figures, report.

mod files;
mod page;
mod table;

pub use files::json;
pub use table::table;

use super::figures::{self, Figure};
use super::groups::groups;
use afbc_campaign::compare::{Comparison, Entry, FIGURES};
use afbc_files::{Error, Folder};
use afbc_sim::flown::Flown;
use afbc_sim::metrics::SETTLED_S;
use std::io;
use std::path::PathBuf;

/// Writes everything about `comparisons` into `folder`, in place of all that its command has left there before, and returns
/// the paths written:
///
/// * `comparison.csv`: a row for each flight;
/// * `comparison.json`: the same, with mean and spread over the seeds;
/// * `errors.svg`, `rmse.svg`: errors over time, and their root mean squares; of several scenarios, each has its own
///   `<scenario>-errors.svg` etc.;
/// * `report.html`: all of it on one page that needs no other file.
///
/// # Errors
/// The first file that could not be written, or is somebody else's.
pub fn write(folder: &Folder, comparisons: &[Comparison]) -> Result<Vec<PathBuf>, Error> {
    let flown: Vec<Flown> =
        comparisons.iter().flat_map(|comparison| &comparison.entries).map(|entry| entry.first.clone()).collect();
    let prefixes: Vec<_> = groups(&flown).into_iter().map(|group| group.figure_prefix).collect();
    let sets = comparisons.iter().map(draw).collect::<io::Result<Vec<_>>>();
    let sets = sets.map_err(|source| folder.error("figures", source))?;
    let svgs = prefixes.iter().zip(&sets).flat_map(|(prefix, figures)| {
        figures.iter().map(move |figure| (format!("{prefix}{}.svg", figure.name), &figure.svg))
    });
    let svgs: Vec<_> = svgs.collect();
    let names = ["comparison.csv", "comparison.json", "report.html"].into_iter();
    folder.only(&names.chain(svgs.iter().map(|(name, _)| name.as_str())).collect::<Vec<_>>())?;

    let mut paths = vec![
        folder.place("comparison.csv", |out| files::csv(out, comparisons))?,
        folder.place("comparison.json", |out| files::json(out, comparisons))?,
    ];
    for (name, svg) in &svgs {
        paths.push(folder.place(name, |out| out.write_all(svg.as_bytes()))?);
    }
    let page = page::page(comparisons, &sets);
    paths.push(folder.place("report.html", |out| out.write_all(page.as_bytes()))?);
    Ok(paths)
}

fn draw(comparison: &Comparison) -> io::Result<Vec<Figure>> {
    let flights: Vec<&Flown> = comparison.entries.iter().map(|entry| &entry.first).collect();
    Ok(vec![figures::compare::draw(comparison)?, figures::errors(&flights)?].into_iter().flatten().collect())
}

/// The figures of one contender, and whether each is the best of its column; none if it lost a vehicle.
fn cells(comparison: &Comparison, entry: &Entry) -> Option<Vec<(String, bool)>> {
    let cell = |figure: &afbc_campaign::compare::Figure| {
        let spread = entry.spread(figure.value)?;
        let [mean, deviation] =
            [spread.mean, spread.deviation].map(|value| number(figure.scale * value, figure.digits));
        let text = if comparison.is_repeated() { format!("{mean} ±{deviation}") } else { mean };
        Some((text, comparison.is_best(entry, figure)))
    };
    let mut cells = FIGURES.iter().map(cell).collect::<Option<Vec<_>>>()?;
    if has_ratio(comparison) {
        cells.push((comparison.ratio(entry).map_or("-".into(), |ratio| format!("{ratio:.2}")), false));
    }
    Some(cells)
}

fn number(value: f64, digits: usize) -> String {
    if value < 1e4 { format!("{value:.digits$}") } else { format!("{value:.2e}") }
}

/// Whether there is backstepping to set others against.
fn has_ratio(comparison: &Comparison) -> bool {
    comparison.entries.iter().any(|entry| comparison.ratio(entry).is_some())
}

/// Heads of the columns.
fn heads(comparison: &Comparison) -> Vec<&'static str> {
    FIGURES.iter().map(|figure| figure.title).chain(has_ratio(comparison).then_some("ratio")).collect()
}

/// What became of the vehicles of a contender that lost some.
fn lost(entry: &Entry) -> String {
    let of = entry.flights.len();
    let first = entry.flights.iter().find_map(|flight| flight.lost.map(|lost| (flight.seed, lost)));
    match first {
        Some((seed, lost)) if of > 1 => {
            let how = super::words::lost(&lost);
            format!("{} of {of} vehicles lost, the first with seed {seed}: {how}", entry.lost())
        }
        Some((_, lost)) => super::words::lost(&lost),
        None => String::new(),
    }
}

/// What the columns mean.
fn legend(comparisons: &[Comparison]) -> String {
    let kept = |comparison: &Comparison| comparison.entries.iter().any(|entry| entry.lost() == 0);
    if !comparisons.iter().any(kept) {
        return "Who loses a vehicle has no figures.".into();
    }
    let mut words = format!(
        "Root mean square errors, and the largest of x, y and z, from {SETTLED_S} s to the end. |ΔU₄|: mean jump of the \
         thrust from one control step to the next; small is smooth."
    );
    if comparisons.iter().any(has_ratio) {
        words += " Ratio: root mean square distance from the reference, over backstepping's.";
    }
    words += " *: best of its column.";
    if comparisons.iter().any(Comparison::is_repeated) {
        words += " ±: standard deviation over the seeds.";
    }
    words
}

//! Contents of a comparison's table, for the HTML page and the terminal.

use crate::differences::{self, number};
use crate::grid::{Grid, GridCell};
use crate::words;
use afbc_campaign::compare::{Comparison, ContenderFlights, MEASURES, Measure};
use afbc_campaign::statistics::Median;
use afbc_sim::metrics::SETTLED_S;

/// Function that formats a median.
type MedianFormat = fn(&Median, &Measure) -> String;

/// Formats a median without its interval.
pub(super) fn alone(median: &Median, measure: &Measure) -> String {
    number(median.value, measure)
}

/// Returns the medians of one contender, and whether each is the best of its column; `None` if a median is a lost
/// flight's.
pub(super) fn cells(comparison: &Comparison, entry: &ContenderFlights, shown: MedianFormat) -> Option<Vec<GridCell>> {
    let cell = |figure: &Measure| {
        let text = shown(&entry.median(figure.value)?, figure);
        Some(GridCell { text, best: comparison.is_best(entry, figure) })
    };
    let mut cells = MEASURES.iter().map(cell).collect::<Option<Vec<_>>>()?;
    if has_ratio(comparison) {
        cells.push(comparison.ratio(entry).map_or("-".into(), |ratio| format!("{ratio:.2}")).into());
    }
    Some(cells)
}

/// Returns the tables for a paper: the medians of all figures of merit, and the differences in distance.
pub(super) fn grids(comparison: &Comparison) -> Vec<Grid> {
    let row = |entry: &ContenderFlights| {
        let cells = cells(comparison, entry, differences::median);
        (entry.contender().title().to_owned(), cells.unwrap_or_else(|| vec!["lost".into()]))
    };
    let mut rows: Vec<_> = comparison.entries.iter().map(row).collect();
    let heads: Vec<String> = ["law"].into_iter().chain(heads(comparison)).map(String::from).collect();
    rows.iter_mut().for_each(|(_, cells)| cells.resize(heads.len() - 1, "".into()));
    let caption = format!("{}: {}", comparison.scenario.name, words::conditions(&comparison.scenario));
    let note = legend(core::slice::from_ref(comparison)).replace(" *: best of the column.", "");
    [Grid { caption, heads, rows, note }].into_iter().chain(differences::grid(comparison)).collect()
}

/// Returns true if backstepping flew, so that ratios to it exist.
pub(super) fn has_ratio(comparison: &Comparison) -> bool {
    comparison.entries.iter().any(|entry| comparison.ratio(entry).is_some())
}

/// Returns the column heads.
pub(super) fn heads(comparison: &Comparison) -> Vec<&'static str> {
    MEASURES.iter().map(|figure| figure.title).chain(has_ratio(comparison).then_some("ratio")).collect()
}

/// Describes the losses of a contender.
pub(super) fn lost(entry: &ContenderFlights) -> String {
    let of = entry.flights.len();
    let first = entry.flights.iter().find_map(|flight| flight.lost.map(|lost| (flight.seed, lost)));
    match first {
        Some((seed, lost)) if of > 1 => {
            let how = words::lost(&lost);
            format!("{} of {of} vehicles lost, the first with seed {seed}: {how}", entry.lost())
        }
        Some((_, lost)) => words::lost(&lost),
        None => String::new(),
    }
}

/// Explains the columns.
pub(super) fn legend(comparisons: &[Comparison]) -> String {
    let kept = |comparison: &Comparison| comparison.entries.iter().any(|entry| entry.lost() < entry.flights.len());
    if !comparisons.iter().any(kept) {
        return "A contender that lost a vehicle has no figures.".into();
    }
    let mut words = format!(
        "Root mean square errors, and the largest of x, y and z, from {SETTLED_S} s to the end. |ΔU₄|: mean \
         absolute change of the thrust per control step."
    );
    if comparisons.iter().any(has_ratio) {
        words += " Ratio: root mean square distance from the reference, divided by backstepping's.";
    }
    words += " *: best of the column.";
    if comparisons.iter().any(Comparison::is_repeated) {
        words += " Medians over all seeds.";
    }
    words
}

//! Contents of a comparison's table, for the page and the terminal.

use crate::words;
use afbc_campaign::compare::{Comparison, Entry, MEASURES, Measure};
use afbc_sim::metrics::SETTLED_S;

/// Returns the figures of one contender, and whether each is the best of its column; none if it lost a vehicle.
pub(super) fn cells(comparison: &Comparison, entry: &Entry) -> Option<Vec<(String, bool)>> {
    let cell = |figure: &Measure| {
        let average = entry.average(figure.value)?;
        let [mean, deviation] =
            [average.mean, average.deviation].map(|value| number(figure.scale * value, figure.digits));
        let text = if comparison.is_repeated() { format!("{mean} ±{deviation}") } else { mean };
        Some((text, comparison.is_best(entry, figure)))
    };
    let mut cells = MEASURES.iter().map(cell).collect::<Option<Vec<_>>>()?;
    if has_ratio(comparison) {
        cells.push((comparison.ratio(entry).map_or("-".into(), |ratio| format!("{ratio:.2}")), false));
    }
    Some(cells)
}

pub(super) fn number(value: f64, digits: usize) -> String {
    if value < 1e4 { format!("{value:.digits$}") } else { format!("{value:.2e}") }
}

/// True if backstepping flew, to compare others with.
pub(super) fn has_ratio(comparison: &Comparison) -> bool {
    comparison.entries.iter().any(|entry| comparison.ratio(entry).is_some())
}

/// Returns the heads of the columns.
pub(super) fn heads(comparison: &Comparison) -> Vec<&'static str> {
    MEASURES.iter().map(|figure| figure.title).chain(has_ratio(comparison).then_some("ratio")).collect()
}

/// Describes the losses of a contender.
pub(super) fn lost(entry: &Entry) -> String {
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
    let kept = |comparison: &Comparison| comparison.entries.iter().any(|entry| entry.lost() == 0);
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
    words += " *: best of its column.";
    if comparisons.iter().any(Comparison::is_repeated) {
        words += " ±: standard deviation over the seeds.";
    }
    words
}

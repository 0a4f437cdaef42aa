//! The suite's table for the terminal.

use super::cells::{FIGURES, lost, trip};
use super::{FlownSuite, standing};
use crate::table::wrap;
use afbc_sim::metrics::SETTLED_S;

/// Formats the root mean square distances: a line for each flight, a column for each contender, then every trip.
pub fn table(flown: FlownSuite<'_>) -> String {
    let [rms, ..] = FIGURES;
    let mut rows: Vec<Vec<String>> = Vec::new();
    let mut trips = Vec::new();
    for (_, comparison) in flown.rows() {
        let name = &comparison.scenario.name;
        let titles = comparison.entries.iter().map(|entry| entry.contender().title().to_owned());
        if rows.is_empty() {
            rows.push([String::new()].into_iter().chain(titles).collect());
        }
        let cells = comparison.entries.iter().map(|entry| {
            let best = if rms.is_best(comparison, entry) { "*" } else { " " };
            lost(entry).or_else(|| rms.text(entry)).unwrap_or_default() + best
        });
        rows.push([name.clone()].into_iter().chain(cells).collect());
        let tripped = comparison.entries.iter().filter_map(|entry| Some((entry.contender().title(), trip(entry)?)));
        trips.extend(tripped.map(|(title, trip)| format!("{name}, {title}: {trip}")));
    }
    let width = |column| {
        let widths = rows.iter().filter_map(|row| row.get(column)).map(|cell: &String| cell.chars().count());
        widths.max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..rows.first().map_or(0, Vec::len)).map(width).collect();
    let mut lines: Vec<String> = Vec::new();
    for row in &rows {
        let mut cells = row.iter().zip(&widths);
        let first = cells.next().map_or(String::new(), |(name, width)| format!("{name:<width$}"));
        lines.push(cells.fold(first, |line, (cell, width)| format!("{line}  {cell:>width$}")));
    }
    lines.push(String::new());
    lines.extend(trips);
    let words = format!("{}, from {SETTLED_S} s to the end. *: best of its flight.", rms.title);
    wrap(&mut lines, "", &words);
    let standing = standing::grid(flown);
    lines.extend([String::new(), format!("{}:", standing.caption)]);
    lines.extend(standing.lines());
    wrap(&mut lines, "", &standing.note);
    lines.join("\n") + "\n"
}

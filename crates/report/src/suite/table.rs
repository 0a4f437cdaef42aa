//! Formats a suite's table for the terminal.

use super::cells::{FIGURES, lost, trip};
use super::{FlownSuite, standing};
use crate::grid::parts;
use crate::table::wrap;
use afbc_sim::metrics::SETTLED_S;

/// Formats the root mean square distances, one line per flight and one column per contender; then lists every trip.
pub fn table(flown: FlownSuite<'_>) -> String {
    let [rms, ..] = FIGURES;
    let mut rows: Vec<(String, Vec<String>)> = Vec::new();
    let mut trips: Vec<String> = Vec::new();
    for (_, comparison) in flown.rows() {
        let name = &comparison.scenario.name;
        let titles = comparison.entries.iter().map(|entry| entry.contender().title().to_owned());
        if rows.is_empty() {
            // The added space aligns titles with the numbers, which may have an asterisk.
            rows.push((String::new(), titles.map(|title| title + " ").collect()));
        }
        let cells = comparison.entries.iter().map(|entry| {
            let best = if rms.is_best(comparison, entry) { "*" } else { " " };
            lost(entry).or_else(|| rms.text(entry)).unwrap_or_default() + best
        });
        rows.push((name.clone(), cells.collect()));
        let tripped = comparison.entries.iter().filter_map(|entry| Some((entry.contender().title(), trip(entry)?)));
        trips.extend(tripped.map(|(title, trip)| format!("{name}, {title}: {trip}")));
    }
    let mut lines: Vec<String> = parts(&rows).join(&String::new());
    lines.push(String::new());
    trips.iter().for_each(|trip| wrap(&mut lines, "", trip));
    let words = format!("{}, from {SETTLED_S} s to the end. *: best of the flight.", rms.title);
    wrap(&mut lines, "", &words);
    let standing = standing::grid(flown);
    lines.push(String::new());
    wrap(&mut lines, "", &format!("{}:", standing.caption));
    lines.extend(standing.lines());
    wrap(&mut lines, "", &standing.note);
    lines.join("\n") + "\n"
}

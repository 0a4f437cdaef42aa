//! Formats a comparison's table for the terminal.

use super::cells::{alone, cells, heads, legend, lost};
use crate::differences;
use crate::grid::Grid;
use crate::table::wrap;
use crate::words;
use afbc_campaign::compare::{Comparison, ContenderFlights};

/// Formats one block per scenario, with one line per contender.
pub fn table(comparisons: &[Comparison]) -> String {
    let mut lines = Vec::new();
    for comparison in comparisons {
        let scenario = &comparison.scenario;
        wrap(&mut lines, "", &format!("{}: {}", scenario.name, words::conditions(scenario)));
        block(comparison, &mut lines);
        lines.push(String::new());
    }
    wrap(&mut lines, "", &legend(comparisons));
    lines.push(String::new());
    lines.join("\n")
}

fn block(comparison: &Comparison, lines: &mut Vec<String>) {
    let row = |entry: &ContenderFlights| {
        let cells = cells(comparison, entry, alone).unwrap_or_default();
        (entry.contender().title().to_owned(), cells)
    };
    let heads = [""].into_iter().chain(heads(comparison)).map(String::from).collect();
    let rows = comparison.entries.iter().map(row).collect();
    let parts = Grid { caption: String::new(), heads, rows, note: String::new() }.parts();
    let rule = "─".repeat(parts.iter().flatten().map(|line| line.chars().count()).max().unwrap_or_default());
    lines.push(rule.clone());
    let names = comparison.entries.iter().map(|entry| entry.contender().title().chars().count()).max();
    for (index, figures) in parts.into_iter().enumerate() {
        lines.extend((index > 0).then(String::new));
        lines.extend(figures.first().cloned());
        for (entry, line) in comparison.entries.iter().zip(figures.into_iter().skip(1)) {
            match cells(comparison, entry, alone) {
                Some(_) => lines.push(line),
                // Describe the loss once: the contender has no numbers in the parts below, either.
                None if index == 0 => {
                    let name = format!("{:<1$}  ", entry.contender().title(), names.unwrap_or_default());
                    wrap(lines, &name, &lost(entry));
                }
                None => {}
            }
        }
    }
    lines.push(rule);
    if let Some(grid) = differences::grid(comparison) {
        lines.push(String::new());
        wrap(lines, "", &format!("{}:", grid.caption));
        lines.extend(grid.lines());
        for entry in comparison.entries.iter().filter(|entry| 0 < entry.lost() && entry.lost() < entry.flights.len()) {
            wrap(lines, "", &format!("{}: {}.", entry.contender().title(), lost(entry)));
        }
        wrap(lines, "", &grid.note);
    }
}

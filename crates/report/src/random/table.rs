//! How the contenders stand, for the terminal.

use super::Judged;
use super::cells::{cells, heads, legend, notes};
use crate::table::wrap;

/// Formats how the contenders stand: a block for each vehicle and one for all, and what the columns are.
pub fn table(judged: &Judged<'_>) -> String {
    let mut rows: Vec<Vec<String>> = Vec::new();
    for group in &judged.groups {
        let head = format!("{}, {} flights", group.name(), group.flights);
        rows.push([head].into_iter().chain(heads(judged)).collect());
        for (contender, ranking) in judged.contenders().iter().zip(&group.rankings) {
            let name = format!("  {}", contender.title());
            rows.push([name].into_iter().chain(cells(group, ranking)).collect());
        }
    }
    let columns = rows.first().map_or(0, Vec::len);
    let width = |column: usize| rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max();
    let widths: Vec<usize> = (0..columns).map(|column| width(column).unwrap_or_default()).collect();
    let mut formatted = rows.iter().map(|row| {
        let cells = row.iter().zip(&widths).enumerate();
        let cell = |(column, (cell, width)): (usize, (&String, &usize))| match column {
            0 => format!("{cell:<width$}"),
            _ => format!("  {cell:>width$}"),
        };
        cells.map(cell).collect::<String>()
    });
    let mut lines = vec![format!("Suite random: {}.", judged.words()), String::new()];
    for group in &judged.groups {
        lines.extend(formatted.by_ref().take(1 + group.rankings.len()));
        for note in notes(judged, group) {
            wrap(&mut lines, "  ", &note);
        }
        lines.push(String::new());
    }
    wrap(&mut lines, "", &legend(judged));
    lines.join("\n") + "\n"
}

//! Formats the contenders' ranking for the terminal.

use super::RandomResults;
use super::cells::{cells, heads, legend, notes};
use crate::grid::parts;
use crate::table::wrap;

/// Formats the contenders' ranking: one block per vehicle and one for all vehicles, and an explanation of the columns.
pub fn table(judged: &RandomResults<'_>) -> String {
    let mut rows: Vec<(String, Vec<String>)> = Vec::new();
    for group in &judged.groups {
        let head = format!("{}, {} flights", group.name(), group.flights);
        rows.push((head, Vec::from(heads(judged))));
        for (contender, ranking) in judged.contenders().iter().zip(&group.rankings) {
            let name = format!("  {}", contender.title());
            rows.push((name, Vec::from(cells(group, ranking))));
        }
    }
    let mut parts: Vec<_> = parts(&rows).into_iter().map(Vec::into_iter).collect();
    let mut lines = Vec::new();
    wrap(&mut lines, "", &format!("Suite random: {}.", judged.words()));
    lines.push(String::new());
    for group in &judged.groups {
        parts.iter_mut().for_each(|part| lines.extend(part.take(1 + group.rankings.len())));
        for note in notes(judged, group) {
            wrap(&mut lines, "  ", &note);
        }
        lines.push(String::new());
    }
    wrap(&mut lines, "", &legend(judged));
    lines.join("\n") + "\n"
}

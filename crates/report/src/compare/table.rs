//! The comparison's table for the terminal.

use super::cells::{cells, heads, legend, lost};
use crate::table::wrap;
use crate::words;
use afbc_campaign::compare::Comparison;

/// Space between columns.
const GAP: usize = 2;

/// Formats one block for each scenario with one line for each contender.
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
    let width = |text: &str| text.chars().count();
    let marked = |(text, best): (String, bool)| text + if best { "*" } else { " " };
    let rows: Vec<(&str, Result<Vec<String>, String>)> = comparison
        .entries
        .iter()
        .map(|entry| {
            let cells = cells(comparison, entry).map(|cells| cells.into_iter().map(marked).collect());
            (entry.contender().title(), cells.ok_or_else(|| lost(entry)))
        })
        .collect();
    let heads: Vec<String> = heads(comparison).into_iter().map(|head| format!("{head} ")).collect();
    let widest = |(column, head): (usize, &String)| {
        let cells = rows.iter().filter_map(|(_, cells)| cells.as_ref().ok()?.get(column)).map(|cell| width(cell));
        cells.max().unwrap_or(0).max(width(head)) + GAP
    };
    let widths: Vec<usize> = heads.iter().enumerate().map(widest).collect();
    let name_width = rows.iter().map(|(name, _)| width(name)).max().unwrap_or(0);
    let line = |name: &str, cells: &[String]| {
        let right = |(cell, to): (&String, &usize)| " ".repeat(to.saturating_sub(width(cell))) + cell;
        format!(
            "{name}{}{}",
            " ".repeat(name_width - width(name)),
            cells.iter().zip(&widths).map(right).collect::<String>()
        )
    };
    let head = line("", &heads);
    let rule = "─".repeat(width(&head));
    lines.extend([rule.clone(), head]);
    for (name, cells) in &rows {
        lines.push(match cells {
            Ok(cells) => line(name, cells),
            Err(lost) => format!("{name}{}  {lost}", " ".repeat(name_width - width(name))),
        });
    }
    lines.push(rule);
}

//! A campaign's table for the terminal.

use super::cells::{HEADS, bad, cells, flights, legend};
use crate::table::wrap;
use afbc_campaign::Summary;

/// Space between columns.
const GAP: usize = 2;

/// Formats the results of every contender, and each one's worst flight with the command that flies it again; `target`
/// is the campaign's name for `sitl campaign`.
pub fn table(summary: &Summary, target: &str) -> String {
    let manifest = &summary.manifest;
    let mut lines = vec![format!("{}: {} flights each", manifest.name, flights(summary))];
    let body: Vec<_> = summary.tallies.iter().map(cells).collect();
    let columns: Vec<_> = HEADS.iter().flat_map(|(_, columns)| columns.iter()).collect();
    let width = |text: &str| text.chars().count();
    let mut widths: Vec<_> = columns
        .iter()
        .enumerate()
        .map(|(i, head)| {
            body.iter().filter_map(|cells| cells.get(i)).map(|cell| width(cell)).max().unwrap_or(0).max(width(head))
        })
        .collect();
    let name_width = summary.tallies.iter().map(|tally| width(&tally.contender)).max().unwrap_or(0);
    let right = |text: &str, to: usize| " ".repeat((to + GAP).saturating_sub(width(text))) + text;

    let mut groups = " ".repeat(name_width);
    let mut rest = widths.iter_mut();
    for (group, columns) in HEADS {
        let mut columns: Vec<_> = rest.by_ref().take(columns.len()).collect();
        let room = columns.iter().map(|width| **width + GAP).sum::<usize>() - GAP;
        if let Some(first) = columns.first_mut() {
            **first += width(group).saturating_sub(room);
        }
        groups += &right(group, room.max(width(group)));
    }
    let row = |name: &str, cells: &mut dyn Iterator<Item = &str>| {
        let cells: String = cells.zip(&widths).map(|(cell, &width)| right(cell, width)).collect();
        name.to_owned() + &" ".repeat(name_width - width(name)) + &cells
    };
    let head = row("", &mut columns.iter().map(|head| **head));
    let rule = "─".repeat(width(&head));
    lines.extend([rule.clone(), groups, head]);
    for (tally, cells) in summary.tallies.iter().zip(&body) {
        lines.push(row(&tally.contender, &mut cells.iter().map(String::as_str)));
    }
    lines.push(rule);
    wrap(&mut lines, "", &legend(summary));
    lines.extend([String::new(), "Worst flights".into()]);
    for tally in &summary.tallies {
        if let Some(worst) = tally.worst.first() {
            let [how, command] = bad(target, tally, worst);
            lines.extend([format!("  {}: {how}", tally.contender), format!("    {command}")]);
        }
    }
    lines.push(String::new());
    lines.join("\n")
}

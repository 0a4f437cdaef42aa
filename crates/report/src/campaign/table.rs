//! Formats a campaign's table for the terminal.

use super::cells::{HEADS, bad, cells, flights, legend};
use crate::table::{line_width, wrap};
use afbc_campaign::CampaignSummary;

/// Space between columns.
const GAP: usize = 2;

/// A group of columns with a common title.
struct ColumnGroup {
    title: &'static str,
    heads: &'static [&'static str],
    widths: Vec<usize>,
    /// Index of the group's first cell in a row.
    first: usize,
}

impl ColumnGroup {
    fn room(&self) -> usize {
        self.widths.iter().map(|width| width + GAP).sum()
    }

    /// Returns the group's part of a row.
    fn cells<'a>(&self, cells: impl IntoIterator<Item = &'a str>) -> String {
        cells.into_iter().zip(&self.widths).map(|(cell, width)| right(cell, width + GAP)).collect()
    }
}

fn width(text: &str) -> usize {
    text.chars().count()
}

fn right(text: &str, to: usize) -> String {
    " ".repeat(to.saturating_sub(width(text))) + text
}

/// Returns the groups; each column is as wide as its widest cell or head.
fn groups(body: &[Vec<String>]) -> Vec<ColumnGroup> {
    let mut first = 0;
    let mut groups = Vec::new();
    for (title, heads) in HEADS {
        let cell = |row: &Vec<String>, index: usize| row.get(index).map_or(0, |cell| width(cell));
        let widest = |index: usize| body.iter().map(|row| cell(row, index)).max().unwrap_or(0);
        let widths = heads.iter().enumerate().map(|(index, head)| widest(first + index).max(width(head))).collect();
        let mut group = ColumnGroup { title, heads, widths, first };
        let lacks = (width(title) + GAP).saturating_sub(group.room());
        group.widths.iter_mut().take(1).for_each(|width| *width += lacks);
        first += heads.len();
        groups.push(group);
    }
    groups
}

/// Divides the groups into tables that fit the width of a line.
fn parts(groups: Vec<ColumnGroup>, name_width: usize) -> Vec<Vec<ColumnGroup>> {
    let mut parts: Vec<Vec<ColumnGroup>> = Vec::new();
    for group in groups {
        let used = |part: &Vec<ColumnGroup>| name_width + part.iter().map(ColumnGroup::room).sum::<usize>();
        match parts.last_mut().filter(|part| used(part) + group.room() <= line_width()) {
            Some(part) => part.push(group),
            None => parts.push(vec![group]),
        }
    }
    parts
}

/// Formats the results of every contender, and the worst flight of each with the command that repeats it. `target` is
/// the campaign's name for `sitl campaign`.
pub fn table(summary: &CampaignSummary, target: &str) -> String {
    let manifest = &summary.manifest;
    let mut lines = vec![format!("{}: {} flights each", manifest.name, flights(summary))];
    let body: Vec<_> = summary.tallies.iter().map(cells).collect();
    let name_width = summary.tallies.iter().map(|tally| width(&tally.contender)).max().unwrap_or(0);
    for part in parts(groups(&body), name_width) {
        let row = |name: &str, cells: &dyn Fn(&ColumnGroup) -> String| {
            let cells: String = part.iter().map(cells).collect();
            format!("{name:<name_width$}{cells}")
        };
        let head = row("", &|group| group.cells(group.heads.iter().copied()));
        lines.extend(["─".repeat(width(&head)), row("", &|group| right(group.title, group.room())), head]);
        for (tally, cells) in summary.tallies.iter().zip(&body) {
            let own = |group: &ColumnGroup| group.cells(cells.iter().skip(group.first).map(String::as_str));
            lines.push(row(&tally.contender, &own));
        }
    }
    lines.push("─".repeat(lines.last().map_or(0, |line| width(line))));
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

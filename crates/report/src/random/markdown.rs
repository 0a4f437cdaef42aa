//! The contenders' ranking as Markdown, for a document.

use super::RandomResults;
use super::cells::{cells, heads, legend, notes};
use crate::table::wrap;
use core::fmt::Write;

/// Formats as Markdown: the settings, one table per vehicle and one for all vehicles, and an explanation of the
/// columns.
pub fn markdown(judged: &RandomResults<'_>) -> String {
    let mut page = paragraph(&format!("Drawn from {}.", judged.words()));
    let escaped = |cell: &str| cell.replace('[', "\\[").replace(']', "\\]");
    for group in &judged.groups {
        let heads = heads(judged).map(|head| escaped(&head));
        let rule = "--:|".repeat(heads.len());
        // Writing to a String cannot fail.
        let _ = writeln!(page, "\n| {}, {} flights | {} |", group.name(), group.flights, heads.join(" | "));
        let _ = writeln!(page, "|---|{rule}");
        for (contender, ranking) in judged.contenders().iter().zip(&group.rankings) {
            let cells = cells(group, ranking).map(|cell| escaped(&cell));
            let _ = writeln!(page, "| {} | {} |", contender.title(), cells.join(" | "));
        }
        notes(judged, group).iter().for_each(|note| page += &format!("\n{}", paragraph(note)));
    }
    page + "\n" + &paragraph(&legend(judged))
}

fn paragraph(text: &str) -> String {
    let mut lines = Vec::new();
    wrap(&mut lines, "", text);
    lines.join("\n") + "\n"
}

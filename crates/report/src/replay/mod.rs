//! Results of a replayed log: table, CSV, JSON, figures, HTML page.

mod cells;
mod files;
mod log;
mod page;

pub use files::{columns, json};
pub use log::ReplayedRecording;

use crate::figures;
use crate::table::wrap;
use crate::words::slug;
use afbc_files::{Error, Folder};
use std::path::PathBuf;

/// Returns the name of the results folder for a log.
#[must_use]
pub fn folder_name(name: &str) -> String {
    format!("replay-{}", slug(name))
}

/// Writes all results of a replay into `folder`, and removes all earlier files of the same command. Returns the paths
/// written:
///
/// * `replay.csv`: both estimates over time;
/// * `summary.json`: their differences, and the data used;
/// * `attitude.svg`, `velocity.svg`, `position.svg`, `difference.svg`: figures;
/// * `report.html`: all results on one self-contained page.
///
/// # Errors
/// Fails at the first file that cannot be written, or that another command has written.
pub fn write(folder: &Folder, replay: &ReplayedRecording<'_>) -> Result<Vec<PathBuf>, Error> {
    let pictures = figures::replay::draw(replay.recording, replay.replayed);
    let svgs: Vec<_> = pictures.iter().map(|picture| format!("{}.svg", picture.name)).collect();
    let names = ["replay.csv", "summary.json", "report.html"].into_iter();
    folder.only(&names.chain(svgs.iter().map(String::as_str)).collect::<Vec<_>>())?;
    let mut paths = vec![
        folder.write("replay.csv", |out| files::csv(out, replay))?,
        folder.write("summary.json", |out| files::json(out, replay))?,
    ];
    for (name, picture) in svgs.iter().zip(&pictures) {
        paths.push(folder.write(name, |out| out.write_all(picture.svg.as_bytes()))?);
    }
    let page = page::page(replay, &pictures);
    paths.push(folder.write("report.html", |out| out.write_all(page.as_bytes()))?);
    Ok(paths)
}

/// Formats the table for the terminal.
#[must_use]
pub fn table(replay: &ReplayedRecording<'_>) -> String {
    let mut lines = Vec::new();
    wrap(&mut lines, "", &format!("{}: {}.", replay.name, cells::conditions(replay)));
    lines.push(String::new());
    let rows = cells::rows(replay);
    let width = |text: &str| text.chars().count();
    let first = rows.iter().map(|row| width(row.name)).max().unwrap_or_default();
    let pad = |text: &str, to: usize| " ".repeat(to.saturating_sub(width(text)));
    let heads = cells::HEADS;
    let widths = [0, 1, 2, 3].map(|column| {
        let cells = rows.iter().filter_map(|row| row.cells.get(column)).map(|cell| width(cell));
        cells.chain(heads.get(column).map(|head| width(head))).max().unwrap_or_default()
    });
    let line = |name: &str, cells: &mut dyn Iterator<Item = &str>| {
        let cells: String = cells.zip(widths).map(|(cell, to)| format!("  {}{cell}", pad(cell, to))).collect();
        format!("{name}{}{cells}", pad(name, first))
    };
    let head = line("", &mut heads.into_iter());
    let rule = "─".repeat(width(&head));
    lines.extend([rule.clone(), head]);
    lines.extend(rows.iter().map(|row| line(row.name, &mut row.cells.iter().map(String::as_str))));
    lines.extend([rule, String::new()]);
    for sentence in cells::sentences(replay) {
        wrap(&mut lines, "", &sentence);
    }
    lines.push(String::new());
    lines.join("\n")
}

//! Results of the suite `rough-estimate`: quality of the estimate in each class, and every flight.

mod cells;
mod files;
mod judged;

pub use files::json;
pub use judged::RoughResults;

use crate::grid::{self, Grid, TableFormat};
use crate::report::sheet;
use crate::table::wrap;
use afbc_files::{Error, Folder};
use core::fmt::Write;
use maud::html;
use std::path::PathBuf;

fn grid(results: &RoughResults<'_>) -> Grid {
    Grid {
        caption: cells::words(results),
        heads: ["class"].into_iter().chain(cells::HEADS).map(String::from).collect(),
        rows: results.rows.iter().map(|row| (cells::name(row).to_owned(), cells::cells(row))).collect(),
        note: cells::legend(),
    }
}

/// Writes all results into `folder`, and removes all earlier files of the same command. Returns the paths written:
///
/// * `flights.csv`: one row per flight;
/// * `rough-estimate.json`: one row per class;
/// * `tables.md`, `tables.tex`: the table for a paper;
/// * `report.html`: the same on one self-contained page.
///
/// # Errors
/// Fails at the first file that cannot be written, or that another command has written.
pub fn write(folder: &Folder, results: &RoughResults<'_>) -> Result<Vec<PathBuf>, Error> {
    folder.only(&["flights.csv", "rough-estimate.json", "tables.md", "tables.tex", "report.html"])?;
    let [md, tex] = [TableFormat::Markdown, TableFormat::Latex].map(|format| tables(results, format));
    let shown = grid(results);
    let body = html! { p { (shown.caption) "." } (shown.section()) (cells::meanings()) };
    let page = sheet("Suite rough-estimate", &body);
    Ok(vec![
        folder.write("flights.csv", |out| files::csv(out, results))?,
        folder.write("rough-estimate.json", |out| files::json(out, results))?,
        folder.write("tables.md", |out| out.write_all(md.as_bytes()))?,
        folder.write("tables.tex", |out| out.write_all(tex.as_bytes()))?,
        folder.write("report.html", |out| out.write_all(page.as_bytes()))?,
    ])
}

/// Formats the table for a paper.
pub fn tables(results: &RoughResults<'_>, format: TableFormat) -> String {
    grid::tables(&[grid(results)], "rough-estimate", format)
}

/// Formats the table for the terminal: one line per class, and an explanation of the columns.
pub fn table(results: &RoughResults<'_>) -> String {
    let shown = grid(results);
    let mut lines = vec![format!("Suite rough-estimate: {}.", shown.caption), String::new()];
    lines.extend(shown.lines());
    lines.push(String::new());
    wrap(&mut lines, "", &shown.note);
    lines.join("\n") + "\n"
}

/// Formats the settings and the table as Markdown, for a document.
pub fn markdown(results: &RoughResults<'_>) -> String {
    let shown = grid(results);
    let mut lines = Vec::new();
    wrap(&mut lines, "", &format!("{}.", shown.caption));
    let mut page = lines.join("\n") + "\n\n";
    // Writing to a String cannot fail.
    let _ = writeln!(page, "| {} |\n|---|{}", shown.heads.join(" | "), "--:|".repeat(cells::HEADS.len()));
    for (name, cells) in &shown.rows {
        let cells: Vec<&str> = cells.iter().map(|cell| cell.text.as_str()).collect();
        let _ = writeln!(page, "| {name} | {} |", cells.join(" | "));
    }
    page
}

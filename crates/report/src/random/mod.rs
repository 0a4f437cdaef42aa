//! Results of the suite `random`: the contenders' ranking per vehicle and overall, and every flight.

mod cells;
mod files;
mod grids;
mod judged;
mod markdown;
mod page;
mod shown;
mod table;

pub use files::json;
pub use judged::Judged;
pub use markdown::markdown;
pub use table::table;

use crate::grid::{self, TableFormat};
use afbc_campaign::compare::Comparison;
use afbc_files::{Error, Folder};
use shown::Shown;
use std::path::PathBuf;

/// Writes all results into `folder`, and removes all earlier files of the same command. Returns the paths written:
///
/// * `flights.csv`: one row per flight of each contender;
/// * `random.json`: the contenders' ranking;
/// * `tables.md`, `tables.tex`: tables for a paper;
/// * `report.html`: the same on one self-contained page, plus an interactive view of the [telling](Judged::telling)
///   flights, from their repetitions in `again`.
///
/// # Errors
/// Fails at the first file that cannot be written, or that another command has written.
pub fn write(folder: &Folder, judged: &Judged<'_>, again: &[Comparison]) -> Result<Vec<PathBuf>, Error> {
    folder.only(&["flights.csv", "random.json", "tables.md", "tables.tex", "report.html"])?;
    let page = page::page(judged, again.iter().map(Shown::of).collect());
    let [md, tex] = [TableFormat::Markdown, TableFormat::Latex].map(|format| tables(judged, format));
    Ok(vec![
        folder.place("flights.csv", |out| files::csv(out, judged))?,
        folder.place("random.json", |out| files::json(out, judged))?,
        folder.place("tables.md", |out| out.write_all(md.as_bytes()))?,
        folder.place("tables.tex", |out| out.write_all(tex.as_bytes()))?,
        folder.place("report.html", |out| out.write_all(page.as_bytes()))?,
    ])
}

/// Formats the tables for a paper: the contenders' ranking per vehicle, and over all vehicles.
pub fn tables(judged: &Judged<'_>, format: TableFormat) -> String {
    grid::tables(&grids::grids(judged), "random", format)
}

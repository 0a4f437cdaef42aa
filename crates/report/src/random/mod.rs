//! Results of the suite `random`: how the contenders stand on each vehicle and in all, and every flight.

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

/// Writes everything about the flights into `folder`, replacing all earlier files of its command, and returns the paths
/// written:
///
/// * `flights.csv`: a row for each flight of each contender;
/// * `random.json`: how the contenders stand;
/// * `tables.md`, `tables.tex`: the tables for a paper;
/// * `report.html`: the same on one self-contained page, with the [telling](Judged::telling) flights, flown `again`.
///
/// # Errors
/// The first file that could not be written, or is not the command's.
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

/// Formats the tables for a paper: how the contenders stand on each vehicle, and on all.
pub fn tables(judged: &Judged<'_>, format: TableFormat) -> String {
    grid::tables(&grids::grids(judged), "random", format)
}

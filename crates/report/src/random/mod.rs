//! Results of the suite `random`: the contenders' ranking per vehicle and overall, and every flight.

mod cells;
mod files;
mod grids;
mod markdown;
mod page;
mod results;
mod shown_flight;
mod table;

pub use files::json;
pub use markdown::markdown;
pub use results::RandomResults;
pub use table::table;

use crate::grid::{self, TableFormat};
use afbc_campaign::compare::Comparison;
use afbc_files::{Error, Folder};
use shown_flight::ShownFlight;
use std::path::PathBuf;

/// Writes all results into `folder`, and removes all earlier files of the same command. Returns the paths written:
///
/// * `flights.csv`: one row per flight of each contender;
/// * `random.json`: the contenders' ranking;
/// * `tables.md`, `tables.tex`: tables for a paper;
/// * `report.html`: the same on one self-contained page, plus an interactive view of the
///   [telling](RandomResults::telling) flights, from their repetitions in `again`.
///
/// # Errors
/// Fails at the first file that cannot be written, or that another command has written.
pub fn write(folder: &Folder, judged: &RandomResults<'_>, again: &[Comparison]) -> Result<Vec<PathBuf>, Error> {
    folder.only(&["flights.csv", "random.json", "tables.md", "tables.tex", "report.html"])?;
    let page = page::page(judged, again.iter().map(ShownFlight::of).collect());
    let [md, tex] = [TableFormat::Markdown, TableFormat::Latex].map(|format| tables(judged, format));
    Ok(vec![
        folder.write("flights.csv", |out| files::csv(out, judged))?,
        folder.write("random.json", |out| files::json(out, judged))?,
        folder.write("tables.md", |out| out.write_all(md.as_bytes()))?,
        folder.write("tables.tex", |out| out.write_all(tex.as_bytes()))?,
        folder.write("report.html", |out| out.write_all(page.as_bytes()))?,
    ])
}

/// Formats the tables for a paper: the contenders' ranking per vehicle, and over all vehicles.
pub fn tables(judged: &RandomResults<'_>, format: TableFormat) -> String {
    grid::tables(&grids::grids(judged), "random", format)
}

//! Results of a suite: tables of flights and contenders for page, terminal and documents, CSV and JSON.

mod cells;
mod files;
mod flight_figures;
mod flown;
mod heat;
mod markdown;
mod page;
mod standing;
mod table;

pub use files::json;
pub use flown::FlownSuite;
pub use markdown::{markdown, markers};
pub use table::table;

use crate::differences;
use crate::grid::{self, TableFormat};
use afbc_campaign::compare::Comparison;
use afbc_files::{Error, Folder};
use cells::FIGURES;
use flight_figures::FlightFigures;
use std::path::PathBuf;

/// Writes all results of a suite into `folder`, and removes all earlier files of the same command. Returns the paths
/// written:
///
/// * `suite.csv`: one row per flight of each contender;
/// * `suite.json`: means, medians and differences over the seeds, losses and trips;
/// * `statistics.csv`: one row per figure of each contender in each flight: its median, its difference to the reference
///   contender's, and the significance of that difference;
/// * `standing.csv`: one row per contender: its ranking over all flights;
/// * `tables.md`, `tables.tex`: tables for a paper;
/// * `<flight>.svg`: errors of every contender over time, with the suite's own seed;
/// * `report.html`: all results on one self-contained page.
///
/// # Errors
/// Fails at the first file that cannot be written, or that another command has written.
pub fn write(folder: &Folder, flown: FlownSuite<'_>) -> Result<Vec<PathBuf>, Error> {
    let drawn: Vec<FlightFigures> = flown.comparisons.iter().map(FlightFigures::of).collect();
    let name = |comparison: &Comparison| format!("{}.svg", comparison.scenario.name);
    let svgs: Vec<_> =
        flown.comparisons.iter().zip(&drawn).filter_map(|(c, drawn)| Some((name(c), drawn.errors.as_ref()?))).collect();
    let names = ["suite.csv", "suite.json", "statistics.csv", "standing.csv", "tables.md", "tables.tex", "report.html"];
    let names = names.into_iter();
    folder.only(&names.chain(svgs.iter().map(|(name, _)| name.as_str())).collect::<Vec<_>>())?;

    let mut paths = vec![
        folder.write("suite.csv", |out| files::csv(out, flown))?,
        folder.write("suite.json", |out| files::json(out, flown))?,
        folder.write("statistics.csv", |out| {
            differences::csv(out, flown.comparisons, &FIGURES.each_ref().map(|figure| &figure.measure))
        })?,
        folder.write("standing.csv", |out| standing::csv(out, flown))?,
    ];
    for (name, format) in [("tables.md", TableFormat::Markdown), ("tables.tex", TableFormat::Latex)] {
        let text = tables(flown, format);
        paths.push(folder.write(name, |out| out.write_all(text.as_bytes()))?);
    }
    for (name, errors) in &svgs {
        paths.push(folder.write(name, |out| out.write_all(errors.svg.as_bytes()))?);
    }
    let page = page::page(flown, drawn);
    paths.push(folder.write("report.html", |out| out.write_all(page.as_bytes()))?);
    Ok(paths)
}

/// Formats the tables for a paper: the distances of every flight, and the contenders' ranking over all flights.
pub fn tables(flown: FlownSuite<'_>, format: TableFormat) -> String {
    grid::tables(&standing::grids(flown), &flown.suite.name, format)
}

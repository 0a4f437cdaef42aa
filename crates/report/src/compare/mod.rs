//! Results of a comparison: table, CSV, JSON, figures, HTML page.

mod cells;
mod files;
mod page;
mod table;

pub use files::json;
pub use table::table;

use crate::differences;
use crate::figures::{self, Picture};
use crate::grid::{self, TableFormat};
use crate::groups::groups;
use afbc_campaign::compare::Comparison;
use afbc_files::{Error, Folder};
use afbc_sim::flown::ScenarioFlight;
use std::path::PathBuf;

/// Writes all results of `comparisons` into `folder`, and removes all earlier files of the same command. Returns the
/// paths written:
///
/// * `comparison.csv`: one row per flight;
/// * `comparison.json`: means, medians and differences over the seeds;
/// * `statistics.csv`: one row per figure of each contender: its median, its difference to the reference contender's,
///   and the significance of that difference;
/// * `tables.md`, `tables.tex`: tables for a paper;
/// * `errors.svg`, `rmse.svg`, `trajectory.svg`: errors over time, root mean square errors, and the flights in space;
///   with several scenarios, `<scenario>-errors.svg` etc. for each;
/// * `report.html`: all results on one self-contained page.
///
/// # Errors
/// Fails at the first file that cannot be written, or that another command has written.
pub fn write(folder: &Folder, comparisons: &[Comparison]) -> Result<Vec<PathBuf>, Error> {
    let flown: Vec<ScenarioFlight> =
        comparisons.iter().flat_map(|comparison| &comparison.entries).map(|entry| entry.first.clone()).collect();
    let prefixes: Vec<_> = groups(&flown).into_iter().map(|group| group.figure_prefix).collect();
    let sets: Vec<Vec<Picture>> = comparisons.iter().map(draw).collect();
    let svgs = prefixes.iter().zip(&sets).flat_map(|(prefix, figures)| {
        figures.iter().map(move |figure| (format!("{prefix}{}.svg", figure.name), &figure.svg))
    });
    let svgs: Vec<_> = svgs.collect();
    let names = ["comparison.csv", "comparison.json", "statistics.csv", "tables.md", "tables.tex", "report.html"];
    let names = names.into_iter();
    folder.only(&names.chain(svgs.iter().map(|(name, _)| name.as_str())).collect::<Vec<_>>())?;

    let mut paths = vec![
        folder.write("comparison.csv", |out| files::csv(out, comparisons))?,
        folder.write("comparison.json", |out| files::json(out, comparisons))?,
        folder.write("statistics.csv", |out| differences::csv(out, comparisons, &files::measures()))?,
    ];
    for (name, format) in [("tables.md", TableFormat::Markdown), ("tables.tex", TableFormat::Latex)] {
        let text = tables(comparisons, format);
        paths.push(folder.write(name, |out| out.write_all(text.as_bytes()))?);
    }
    for (name, svg) in &svgs {
        paths.push(folder.write(name, |out| out.write_all(svg.as_bytes()))?);
    }
    let page = page::page(comparisons, &sets);
    paths.push(folder.write("report.html", |out| out.write_all(page.as_bytes()))?);
    Ok(paths)
}

/// Formats the tables for a paper. Per scenario these are the medians of all figures and, with several seeds, the
/// differences in distance to the reference contender.
pub fn tables(comparisons: &[Comparison], format: TableFormat) -> String {
    let of = |comparison: &Comparison| grid::tables(&cells::grids(comparison), &comparison.scenario.name, format);
    comparisons.iter().map(of).collect::<Vec<_>>().join("\n")
}

fn draw(comparison: &Comparison) -> Vec<Picture> {
    let flights: Vec<&ScenarioFlight> = comparison.entries.iter().map(|entry| &entry.first).collect();
    let flown = figures::flights::named(&flights, &[("fig7-errors", "errors"), ("fig4-trajectory", "trajectory")]);
    figures::compare::draw(comparison).into_iter().chain(flown).collect()
}

//! Results of a campaign: table, summary, figures, report.

mod cells;
mod page;
mod summary;
mod table;

pub use summary::write as json;
pub use table::table;

use crate::figures;
use afbc_campaign::Summary;
use afbc_files::{Error, Folder};
use std::path::PathBuf;

/// Writes everything about a campaign except its rows into `folder`, and returns the paths written:
///
/// * `position-error.svg`, `smoothness.svg`: distributions over all flights;
/// * `success.svg`: losses against each drawn quantity;
/// * `summary.json`: the figures as numbers;
/// * `report.html`: everything on one self-contained page.
///
/// # Errors
/// The first file that could not be written, or is not the command's.
pub fn write(folder: &Folder, summary: &Summary) -> Result<Vec<PathBuf>, Error> {
    let figures = figures::campaign::draw(summary);
    let svgs = figures.iter().map(|figure| format!("{}.svg", figure.name));
    folder.add(&svgs.chain(["summary.json".into(), "report.html".into()]).collect::<Vec<_>>())?;
    let mut paths = Vec::new();
    for figure in &figures {
        paths.push(folder.place(&format!("{}.svg", figure.name), |out| out.write_all(figure.svg.as_bytes()))?);
    }
    paths.push(folder.place("summary.json", |out| summary::write(out, summary))?);
    let page = page::page(summary, &figures);
    paths.push(folder.place("report.html", |out| out.write_all(page.as_bytes()))?);
    Ok(paths)
}

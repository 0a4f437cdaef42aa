//! Results of a campaign: table, summary, figures, HTML page.

mod cells;
mod page;
mod summary;
mod table;

pub use summary::write as json;
pub use table::table;

use crate::figures;
use afbc_campaign::CampaignSummary;
use afbc_files::{Error, Folder};
use std::path::PathBuf;

/// Writes all results of a campaign except its rows into `folder`. Returns the paths written:
///
/// * `position-error.svg`, `smoothness.svg`: distributions over all flights;
/// * `success.svg`: losses against each randomly drawn quantity;
/// * `summary.json`: the results as numbers;
/// * `report.html`: all results on one self-contained page.
///
/// # Errors
/// Fails at the first file that cannot be written, or that another command has written.
pub fn write(folder: &Folder, summary: &CampaignSummary) -> Result<Vec<PathBuf>, Error> {
    let figures = figures::campaign::draw(summary);
    let svgs = figures.iter().map(|figure| format!("{}.svg", figure.name));
    folder.add(&svgs.chain(["summary.json".into(), "report.html".into()]).collect::<Vec<_>>())?;
    let mut paths = Vec::new();
    for figure in &figures {
        paths.push(folder.write(&format!("{}.svg", figure.name), |out| out.write_all(figure.svg.as_bytes()))?);
    }
    paths.push(folder.write("summary.json", |out| summary::write(out, summary))?);
    let page = page::page(summary, &figures);
    paths.push(folder.write("report.html", |out| out.write_all(page.as_bytes()))?);
    Ok(paths)
}

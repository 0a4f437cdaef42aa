//! Results of an exact log: what is in it, whether it gives the same again, and what other settings would have
//! commanded.

mod cells;
mod files;
mod page;
mod replayed;

pub use cells::{problem, table};
pub use files::json;
pub use replayed::ReplayedLog;

use crate::figures;
use afbc_files::{Error, Folder};
use std::path::PathBuf;

/// Writes what other settings would have commanded into `folder`, replacing all earlier files of its command, and
/// returns the paths written:
///
/// * `change.csv`: what was commanded, and what would have been, over time;
/// * `summary.json`: what is in the log, and the differences;
/// * `motors.svg`, `demands.svg`, `estimate.svg`: figures;
/// * `report.html`: everything on one self-contained page.
///
/// # Errors
/// The first file that could not be written, or is not the command's.
pub fn write(folder: &Folder, log: &ReplayedLog<'_>) -> Result<Vec<PathBuf>, Error> {
    let pictures = figures::exact::draw(log.replay);
    let svgs: Vec<_> = pictures.iter().map(|picture| format!("{}.svg", picture.name)).collect();
    let names = ["change.csv", "summary.json", "report.html"].into_iter();
    folder.only(&names.chain(svgs.iter().map(String::as_str)).collect::<Vec<_>>())?;
    let mut paths = vec![
        folder.place("change.csv", |out| files::csv(out, log.replay))?,
        folder.place("summary.json", |out| files::json(out, log))?,
    ];
    for (name, picture) in svgs.iter().zip(&pictures) {
        paths.push(folder.place(name, |out| out.write_all(picture.svg.as_bytes()))?);
    }
    let page = page::page(log, &pictures);
    paths.push(folder.place("report.html", |out| out.write_all(page.as_bytes()))?);
    Ok(paths)
}

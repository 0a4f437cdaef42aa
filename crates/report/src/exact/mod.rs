//! Results of an exact log's replay: its contents, whether the replay gives the same results, and the commands that
//! other settings would have given.

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

/// Writes the effect of the changed settings into `folder`, and removes all earlier files of the same command. Returns
/// the paths written:
///
/// * `change.csv`: commands over time, as flown and under the changed settings;
/// * `summary.json`: contents of the log, and the differences;
/// * `motors.svg`, `demands.svg`, `estimate.svg`: figures;
/// * `report.html`: all results on one self-contained page.
///
/// # Errors
/// Fails at the first file that cannot be written, or that another command has written.
pub fn write(folder: &Folder, log: &ReplayedLog<'_>) -> Result<Vec<PathBuf>, Error> {
    let pictures = figures::exact::draw(log.replay);
    let svgs: Vec<_> = pictures.iter().map(|picture| format!("{}.svg", picture.name)).collect();
    let names = ["change.csv", "summary.json", "report.html"].into_iter();
    folder.only(&names.chain(svgs.iter().map(String::as_str)).collect::<Vec<_>>())?;
    let mut paths = vec![
        folder.write("change.csv", |out| files::csv(out, log.replay))?,
        folder.write("summary.json", |out| files::json(out, log))?,
    ];
    for (name, picture) in svgs.iter().zip(&pictures) {
        paths.push(folder.write(name, |out| out.write_all(picture.svg.as_bytes()))?);
    }
    let page = page::page(log, &pictures);
    paths.push(folder.write("report.html", |out| out.write_all(page.as_bytes()))?);
    Ok(paths)
}

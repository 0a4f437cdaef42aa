//! Results of the suite `random`: how the contenders stand on each vehicle and in all, and every flight.

mod cells;
mod files;
mod judged;
mod markdown;
mod page;
mod table;

pub use files::json;
pub use judged::Judged;
pub use markdown::markdown;
pub use table::table;

use afbc_files::{Error, Folder};
use std::path::PathBuf;

/// Writes everything about the flights into `folder`, replacing all earlier files of its command, and returns the paths
/// written:
///
/// * `flights.csv`: a row for each flight of each contender;
/// * `random.json`: how the contenders stand;
/// * `report.html`: the same on one self-contained page.
///
/// # Errors
/// The first file that could not be written, or is not the command's.
pub fn write(folder: &Folder, judged: &Judged<'_>) -> Result<Vec<PathBuf>, Error> {
    folder.only(&["flights.csv", "random.json", "report.html"])?;
    let page = page::page(judged);
    Ok(vec![
        folder.place("flights.csv", |out| files::csv(out, judged))?,
        folder.place("random.json", |out| files::json(out, judged))?,
        folder.place("report.html", |out| out.write_all(page.as_bytes()))?,
    ])
}

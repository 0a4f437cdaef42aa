//! Where results go, and what every command prints that has written a folder with a report.

use super::json::{self, Json};
use super::place::Place;
use super::terminal::{Failure, print};
use afbc_files::Folder;
use clap::Args;
use std::io;
use std::path::PathBuf;

/// Where the results of a comparison go.
#[derive(Args, Debug)]
pub(super) struct Output {
    /// Write the suite's table into this page, between its two markers, and nothing else
    #[arg(long, value_name = "PAGE", requires = "suite", conflicts_with_all = ["json", "out", "force"])]
    pub(super) write: Option<PathBuf>,

    #[command(flatten)]
    pub(super) place: Place,

    #[command(flatten)]
    pub(super) json: Json,
}

/// Prints the results of `files` files in `folder`: what `object` writes, if JSON is asked for, or the table and where
/// the report is.
pub(crate) fn show(
    folder: &Folder,
    files: usize,
    Json { json }: Json,
    object: impl FnOnce(&mut Vec<u8>) -> io::Result<()>,
    table: impl FnOnce() -> String,
) -> Result<(), Failure> {
    if json {
        return json::print_written(object);
    }
    let (table, folder) = (table(), folder.path());
    let page = folder.join("report.html");
    print(&format!("{}\n\n{files} files in {}; open {}\n", table.trim_end(), folder.display(), page.display()))
}

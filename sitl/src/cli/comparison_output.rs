//! Output of commands that write a folder with a report.

use super::json::{self, JsonArgs};
use super::output_folder::OutputFolderArgs;
use super::terminal::{CommandError, columns, print};
use afbc_files::Folder;
use afbc_report::{TableFormat, for_terminal};
use clap::{Args, ValueEnum};
use std::io;
use std::path::PathBuf;

/// Output of a comparison's results.
#[derive(Args, Debug)]
pub(super) struct ComparisonOutputArgs {
    /// Write the suite's table into this page, between its two markers, and nothing else
    #[arg(long, value_name = "PAGE", requires = "suite", conflicts_with_all = ["json", "out", "force"])]
    pub(super) write: Option<PathBuf>,

    /// Print the tables for a paper in this format instead; the output folder has both formats, tables.md and
    /// tables.tex
    #[arg(long, value_name = "FORMAT", conflicts_with_all = ["json", "write"])]
    pub(super) table: Option<TableFormatArg>,

    #[command(flatten)]
    pub(super) place: OutputFolderArgs,

    #[command(flatten)]
    pub(super) json: JsonArgs,
}

/// Format of `--table`.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum TableFormatArg {
    /// Markdown, for GitHub and similar pages
    Markdown,
    /// LaTeX, with the package booktabs
    Latex,
}

impl TableFormatArg {
    fn of_report(self) -> TableFormat {
        match self {
            TableFormatArg::Markdown => TableFormat::Markdown,
            TableFormatArg::Latex => TableFormat::Latex,
        }
    }
}

impl ComparisonOutputArgs {
    /// Prints the tables for a paper if they are requested; otherwise prints as [`show`] does.
    pub(super) fn show(
        &self,
        folder: &Folder,
        files: usize,
        object: impl FnOnce(&mut Vec<u8>) -> io::Result<()>,
        tables: impl FnOnce(TableFormat) -> String,
        table: impl FnOnce() -> String,
    ) -> Result<(), CommandError> {
        match self.table {
            Some(format) => print(&tables(format.of_report())),
            None => show(folder, files, self.json, object, table),
        }
    }
}

/// Prints the results of a command that wrote `files` files into `folder`: the output of `object` if JSON is
/// requested, otherwise the table and the path of the report.
pub(crate) fn show(
    folder: &Folder,
    files: usize,
    JsonArgs { json }: JsonArgs,
    object: impl FnOnce(&mut Vec<u8>) -> io::Result<()>,
    table: impl FnOnce() -> String,
) -> Result<(), CommandError> {
    if json {
        return json::print_written(object);
    }
    let (table, folder) = (for_terminal(columns(), table), folder.path());
    let page = folder.join("report.html");
    print(&format!("{}\n\n{files} files in {}; open {}\n", table.trim_end(), folder.display(), page.display()))
}

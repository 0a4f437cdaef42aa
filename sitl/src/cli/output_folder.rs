//! Output folder of a command: `--out` and `--force`.

use super::manifest;
use super::terminal::CommandError;
use afbc_files::Folder;
use clap::Args;
use std::path::{Path, PathBuf};

/// Options of every command with an output folder.
#[derive(Args, Clone, Debug)]
pub(crate) struct OutputFolderArgs {
    /// Output folder [default: out/NAME, with the name of the scenario, campaign or command]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Write into the folder even if the folder holds something else, such as results of the same command with other
    /// options; replaces files of the same names
    #[arg(long)]
    pub(crate) force: bool,
}

impl OutputFolderArgs {
    /// Returns the folder's path, by default `out/<name>`.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.out.clone().unwrap_or_else(|| Path::new("out").join(name))
    }

    /// Opens the folder for the results of this command line. The folder must be empty, or hold results of the same
    /// command line. `name` selects the default folder.
    pub(crate) fn open(&self, name: &str) -> Result<Folder, CommandError> {
        Ok(Folder::open(&self.path(name), &manifest::own_command().join(" "), name, self.force)?)
    }
}

//! Output folder: `--out` and `--force`.

use super::terminal::Failure;
use afbc_files::Folder;
use clap::Args;
use std::path::{Path, PathBuf};

/// Options of every command with an output folder.
#[derive(Args, Clone, Debug)]
pub(crate) struct Place {
    /// Output folder [default: out/ and the name of the scenario, campaign or command]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Write into the folder even if it holds something else; replaces files of the same names
    #[arg(long)]
    pub(crate) force: bool,
}

impl Place {
    /// Returns its path, by default `out/<name>`.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.out.clone().unwrap_or_else(|| Path::new("out").join(name))
    }

    /// Opens the folder, after checking that it can be used for the results of `sitl <command>` for `name`.
    pub(crate) fn open(&self, command: &str, name: &str) -> Result<Folder, Failure> {
        Ok(Folder::open(&self.path(name), command, name, self.force)?)
    }
}

//! Where results go: `--out` and `--force`.

use super::terminal::Failure;
use afbc_files::Folder;
use clap::Args;
use std::path::{Path, PathBuf};

/// Options of every command that fills a folder.
#[derive(Args, Clone, Debug)]
pub(crate) struct Place {
    /// Folder for what comes of it [default: out/ and the name of what is flown]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Write into the folder even if it is not this command's own; replaces what is in the way
    #[arg(long)]
    pub(crate) force: bool,
}

impl Place {
    /// Where it is, `out/<name>` if nothing was said.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.out.clone().unwrap_or_else(|| Path::new("out").join(name))
    }

    /// The folder, once it is sure that it can take what `sitl <command>` makes of `name`.
    pub(crate) fn open(&self, command: &str, name: &str) -> Result<Folder, Failure> {
        Ok(Folder::open(&self.path(name), command, name, self.force)?)
    }
}

//! `sitl completions` and `sitl man`: what a shell and a reader of manuals want.

use super::terminal::{Failure, print};
use clap::{Args, Command};
use clap_complete::Shell;
use std::path::PathBuf;
use std::process::ExitCode;

/// Name of the program.
const NAME: &str = "sitl";

/// Print completions for a shell
///
/// bash: `sitl completions bash >~/.local/share/bash-completion/completions/sitl`; zsh: `sitl completions zsh
/// >~/.zfunc/_sitl`; fish: `sitl completions fish >~/.config/fish/completions/sitl.fish`.
#[derive(Args, Debug)]
pub(crate) struct Completions {
    /// The shell
    shell: Shell,
}

impl Completions {
    /// Prints the script for the whole command line.
    pub(super) fn run(self, mut program: Command) -> Result<ExitCode, Failure> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut program, NAME, &mut script);
        print(&String::from_utf8(script)?)?;
        Ok(ExitCode::SUCCESS)
    }
}

/// Write the manual into a folder, a page for each command
///
/// `sitl man ~/.local/share/man/man1`, then `man sitl` and `man sitl-fly`.
#[derive(Args, Debug)]
pub(crate) struct Man {
    /// An existing folder
    #[arg(value_name = "FOLDER")]
    folder: PathBuf,
}

impl Man {
    /// Writes the pages of the whole command line.
    pub(super) fn run(self, program: Command) -> Result<ExitCode, Failure> {
        let Man { folder } = self;
        let failed = |problem: &dyn std::fmt::Display| format!("{}: {problem}; name a folder", folder.display());
        if !folder.is_dir() {
            return Err(failed(&"no such folder").into());
        }
        clap_mangen::generate_to(program, &folder).map_err(|error| failed(&error))?;
        print(&format!("{}\n", folder.join("sitl.1").display()))?;
        Ok(ExitCode::SUCCESS)
    }
}

//! `sitl completions` and `sitl man`: shell completions and manual pages.

use super::terminal::{CommandError, print};
use afbc_files::OutputFile;
use clap::{Args, Command};
use clap_complete::Shell;
use clap_complete::env::Shells;
use std::io;
use std::path::PathBuf;
use std::process::ExitCode;

/// Name of the program.
const NAME: &str = "sitl";
/// Environment variable by which a shell requests completions, clap's default.
const VARIABLE: &str = "COMPLETE";

/// Print the completion script for a shell
///
/// The script calls `sitl` for commands, options and the names of scenarios, campaigns, suites, vehicles and laws, so
/// `sitl` must be in the shell's path. bash: `sitl completions bash >~/.local/share/bash-completion/completions/sitl`;
/// zsh: `sitl completions zsh >~/.zfunc/_sitl`; fish: `sitl completions fish >~/.config/fish/completions/sitl.fish`.
#[derive(Args, Debug)]
pub(crate) struct CompletionsArgs {
    /// The shell
    shell: Shell,
}

impl CompletionsArgs {
    /// Prints the completion script.
    pub(super) fn run(self) -> Result<ExitCode, CommandError> {
        let (shell, mut script) = (self.shell.to_string(), Vec::new());
        let shells = Shells::builtins();
        let shell = shells
            .completer(&shell)
            .ok_or_else(|| format!("{shell}: there is no completion for this shell; use another shell"))?;
        shell.write_registration(VARIABLE, NAME, NAME, NAME, &mut script)?;
        print(&String::from_utf8(script)?)?;
        Ok(ExitCode::SUCCESS)
    }
}

/// Write the manual pages into a folder, one for each command
///
/// `sitl man ~/.local/share/man/man1`, then `man sitl` and `man sitl-fly`.
#[derive(Args, Debug)]
pub(crate) struct ManArgs {
    /// An existing folder
    #[arg(value_name = "FOLDER")]
    folder: PathBuf,

    /// Replace existing pages
    #[arg(long)]
    force: bool,
}

impl ManArgs {
    /// Writes the pages of all commands.
    pub(super) fn run(self, program: Command) -> Result<ExitCode, CommandError> {
        let ManArgs { folder, force } = self;
        if !folder.is_dir() {
            return Err(format!("{}: no such folder; name a folder", folder.display()).into());
        }
        let mut program = program.disable_help_subcommand(true);
        program.build();
        let mut outputs = Vec::new();
        for (name, text) in pages(&program)? {
            outputs.push((OutputFile::forcible(&folder.join(name), "the manual", force)?, text));
        }
        for (output, text) in outputs {
            output.write(|out| out.write_all(&text))?;
        }
        print(&format!("{}\n", folder.join("sitl.1").display()))?;
        Ok(ExitCode::SUCCESS)
    }
}

/// Returns the manual pages of a command and its subcommands: file names and texts.
fn pages(command: &Command) -> io::Result<Vec<(String, Vec<u8>)>> {
    let page = clap_mangen::Man::new(command.clone());
    let mut text = Vec::new();
    page.render(&mut text)?;
    let mut all = vec![(page.get_filename(), text)];
    for part in command.get_subcommands().filter(|part| !part.is_hide_set()) {
        all.extend(pages(part)?);
    }
    Ok(all)
}

//! Parsing that is common to all commands.

use clap::error::{ContextKind, ErrorKind};
use clap::{Arg, Command, Error};

/// Prepares `command` and its subcommands: arguments may be negative numbers and, in the full program, are completed
/// by shells.
///
/// `--duration -5` is then reported as a wrong duration, not as an unknown option.
pub(super) fn prepared(command: Command) -> Command {
    #[cfg(feature = "all")]
    let command = super::completion::completed(command);
    command.mut_args(negative).mut_subcommands(prepared)
}

fn negative(arg: Arg) -> Arg {
    if arg.get_action().takes_values() { arg.allow_negative_numbers(true) } else { arg }
}

/// Removes clap's advice to pass an unknown option as a file name.
pub(super) fn advised(mut error: Error) -> Error {
    if error.kind() == ErrorKind::UnknownArgument {
        error.remove(ContextKind::Suggested);
    }
    error
}

//! The command line as it is parsed: what is the same for all of its commands.

use clap::error::{ContextKind, ErrorKind};
use clap::{Arg, Command, Error};

/// Returns `command` and its own commands with arguments that may be negative numbers, and that a shell completes,
/// where there is more than `paper`.
///
/// `--duration -5` is a wrong duration then, not an unknown option.
pub(super) fn prepared(command: Command) -> Command {
    #[cfg(feature = "all")]
    let command = super::completion::completed(command);
    command.mut_args(negative).mut_subcommands(prepared)
}

fn negative(arg: Arg) -> Arg {
    if arg.get_action().takes_values() { arg.allow_negative_numbers(true) } else { arg }
}

/// Returns the error without the advice to take an unknown option for a file's name.
pub(super) fn advised(mut error: Error) -> Error {
    if error.kind() == ErrorKind::UnknownArgument {
        error.remove(ContextKind::Suggested);
    }
    error
}

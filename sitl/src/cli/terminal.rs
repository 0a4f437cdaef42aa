//! Terminal output and exit codes of every command.

use std::error::Error;
use std::io::{self, Write};
use terminal_size::Width;

/// Error of a command, displayed as one line.
pub(crate) type CommandError = Box<dyn Error>;

/// Exit code of an interrupted command.
pub(crate) const INTERRUPTED: u8 = 130;

/// Writes one line to stderr, ignoring errors.
pub(crate) fn say(line: &str) {
    let _ = writeln!(io::stderr().lock(), "{line}");
}

/// Width of text if stdout is no terminal.
const COLUMNS: usize = 100;
/// Smallest width at which text is wrapped.
const COLUMNS_MIN: usize = 40;

/// Returns the width of the terminal on stdout or, without one, the value of $COLUMNS.
pub(crate) fn columns() -> usize {
    let shown = terminal_size::terminal_size_of(io::stdout()).map(|(Width(columns), _)| usize::from(columns));
    let said = || std::env::var("COLUMNS").ok()?.parse().ok();
    shown.or_else(said).unwrap_or(COLUMNS).max(COLUMNS_MIN)
}

/// Prints to stdout. A closed pipe, as in `sitl | head`, is not an error.
pub(crate) fn print(text: &str) -> Result<(), CommandError> {
    match io::stdout().lock().write_all(text.as_bytes()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(format!("stdout cannot be written ({error}); redirect it elsewhere").into())
        }
        _ => Ok(()),
    }
}

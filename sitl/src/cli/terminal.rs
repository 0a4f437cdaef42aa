//! Terminal output and exit codes of every command.

use std::error::Error;
use std::io::{self, Write};

/// Error of a command, displayed as one line.
pub(crate) type Failure = Box<dyn Error>;

/// Exit code of an interrupted command.
pub(crate) const INTERRUPTED: u8 = 130;

/// Writes one line to stderr, ignoring errors.
pub(crate) fn say(line: &str) {
    let _ = writeln!(io::stderr().lock(), "{line}");
}

/// Prints to stdout. A closed pipe, as in `sitl | head`, is no failure.
pub(crate) fn print(text: &str) -> Result<(), Failure> {
    match io::stdout().lock().write_all(text.as_bytes()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(format!("stdout: cannot be written ({error}); send it elsewhere").into())
        }
        _ => Ok(()),
    }
}

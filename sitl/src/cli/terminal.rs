//! What every command says to the terminal, and how it ends.

use std::error::Error;
use std::io::{self, Write};

/// What stops a command: its text is one line for people.
pub(crate) type Failure = Box<dyn Error>;

/// Exit code of a command that was asked to stop.
pub(crate) const INTERRUPTED: u8 = 130;

/// Says one line on stderr, to whoever is still listening.
pub(crate) fn say(line: &str) {
    let _ = writeln!(io::stderr().lock(), "{line}");
}

/// Prints to stdout. A reader who has seen enough, as in `sitl | head`, is no failure.
pub(crate) fn print(text: &str) -> Result<(), Failure> {
    match io::stdout().lock().write_all(text.as_bytes()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(format!("stdout: cannot be written ({error}); send it elsewhere").into())
        }
        _ => Ok(()),
    }
}

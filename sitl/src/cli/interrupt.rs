//! Ctrl-C, and whatever else asks a program to end: of commands that have nothing to show for half of their work, or that
//! keep it whole at any time.

use super::terminal::{INTERRUPTED, say};
use std::io::{IsTerminal, stderr};
use std::sync::{Mutex, PoisonError};

/// Held while files are written.
static WRITING: Mutex<()> = Mutex::new(());

/// From here on Ctrl-C ends the program at once, with one line that nothing was written.
///
/// # Errors
/// If the system gives no way to.
pub(crate) fn ends_it() -> Result<(), ctrlc::Error> {
    ends_with("stopped before the end; nothing was written".into())
}

/// From here on Ctrl-C ends the program at once, whatever it is at, with this `line`.
///
/// # Errors
/// If the system gives no way to.
pub(crate) fn ends_with(line: String) -> Result<(), ctrlc::Error> {
    ctrlc::set_handler(move || {
        let _nothing_is_half_written = WRITING.lock().unwrap_or_else(PoisonError::into_inner);
        // Below the progress bar, if there is one.
        let below = if stderr().is_terminal() { "\n" } else { "" };
        say(&format!("{below}{line}"));
        std::process::exit(INTERRUPTED.into())
    })
}

/// From here on it is too late: what is ready to be written is written, and the program ends as it would have.
pub(crate) fn is_too_late() {
    std::mem::forget(WRITING.lock().unwrap_or_else(PoisonError::into_inner));
}

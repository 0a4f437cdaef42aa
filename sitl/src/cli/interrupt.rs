//! Ctrl-C and termination for commands without partial results, and for those whose partial results are always
//! consistent.

use super::terminal::{INTERRUPTED, say};
use std::io::{IsTerminal, stderr};
use std::sync::{Mutex, PoisonError};

/// Locked while files are written.
static WRITING: Mutex<()> = Mutex::new(());

/// Makes Ctrl-C end the program at once, with the message that nothing was written. Removes logs that the program has
/// begun.
///
/// # Errors
/// If the system does not allow a handler.
pub(crate) fn ends_it() -> Result<(), ctrlc::Error> {
    ends("stopped before the end; nothing was written".into(), afbc_files::remove_created)
}

/// Makes Ctrl-C end the program at once, whatever it is doing, with the message `line`.
///
/// # Errors
/// If the system does not allow a handler.
pub(crate) fn ends_with(line: String) -> Result<(), ctrlc::Error> {
    ends(line, || ())
}

fn ends(line: String, clean: fn()) -> Result<(), ctrlc::Error> {
    ctrlc::set_handler(move || {
        let _nothing_is_half_written = WRITING.lock().unwrap_or_else(PoisonError::into_inner);
        clean();
        // On a terminal, the message goes below the progress bar.
        let below = if stderr().is_terminal() { "\n" } else { "" };
        say(&format!("{below}{line}"));
        std::process::exit(INTERRUPTED.into())
    })
}

/// Makes Ctrl-C ineffective while results are written; the program then ends normally.
pub(crate) fn is_too_late() {
    // The lock is never released again. A handler that is already waiting for it waits until the program ends.
    std::mem::forget(WRITING.lock().unwrap_or_else(PoisonError::into_inner));
}

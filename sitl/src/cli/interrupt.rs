//! Handling of Ctrl-C and termination for commands that have no partial results, or keep them consistent at any time.

use super::terminal::{INTERRUPTED, say};
use std::io::{IsTerminal, stderr};
use std::sync::{Mutex, PoisonError};

/// Held while files are written.
static WRITING: Mutex<()> = Mutex::new(());

/// Makes Ctrl-C end the program at once, with the message that nothing was written; logs that it has begun are removed.
///
/// # Errors
/// If the system does not allow it.
pub(crate) fn ends_it() -> Result<(), ctrlc::Error> {
    ends("stopped before the end; nothing was written".into(), afbc_files::remove_created)
}

/// Makes Ctrl-C end the program at once, whatever it is doing, with this `line`.
///
/// # Errors
/// If the system does not allow it.
pub(crate) fn ends_with(line: String) -> Result<(), ctrlc::Error> {
    ends(line, || ())
}

fn ends(line: String, clean: fn()) -> Result<(), ctrlc::Error> {
    ctrlc::set_handler(move || {
        let _nothing_is_half_written = WRITING.lock().unwrap_or_else(PoisonError::into_inner);
        clean();
        // Below the progress bar, if there is one.
        let below = if stderr().is_terminal() { "\n" } else { "" };
        say(&format!("{below}{line}"));
        std::process::exit(INTERRUPTED.into())
    })
}

/// Makes Ctrl-C ineffective: results are written, and the program ends normally.
pub(crate) fn is_too_late() {
    // Never unlocked again: a handler that has been called waits until the program ends.
    std::mem::forget(WRITING.lock().unwrap_or_else(PoisonError::into_inner));
}

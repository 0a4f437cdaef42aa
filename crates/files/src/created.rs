//! Files that this program has created bit by bit, which it takes back if nothing comes of them.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Their paths.
static CREATED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Remembers a file that was created just now.
pub(crate) fn remember(path: &Path) {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.into());
    CREATED.lock().unwrap_or_else(PoisonError::into_inner).push(path);
}

/// Removes every file that [`Output::create`](crate::Output::create) has created, whatever is in it: for a command that
/// is interrupted, of which nothing stays, so that the same command can be given again.
pub fn remove_created() {
    remove(|_| true);
}

/// Removes those that are empty: for a command that has failed. What somebody has logged stays.
pub fn remove_empty() {
    remove(|path| fs::symlink_metadata(path).is_ok_and(|it| it.is_file() && it.len() == 0));
}

fn remove(is_wanted: impl Fn(&Path) -> bool) {
    for path in CREATED.lock().unwrap_or_else(PoisonError::into_inner).drain(..).filter(|path| is_wanted(path)) {
        // Somebody else may have taken it away.
        let _ = fs::remove_file(path);
    }
}

//! Files that this program has created for incremental writing, so that it can remove them if the command fails.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Paths of the created files.
static CREATED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Remembers a file that was just created.
pub(crate) fn remember(path: &Path) {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.into());
    CREATED.lock().unwrap_or_else(PoisonError::into_inner).push(path);
}

/// Removes every file that [`OutputFile::create`](crate::OutputFile::create) has created, whatever its content. For an
/// interrupted command: it leaves nothing behind, so that the same command can be given again.
pub fn remove_created() {
    remove(|_| true);
}

/// Removes the created files that are empty. For a command that has failed: logged data stay.
pub fn remove_empty() {
    remove(|path| fs::symlink_metadata(path).is_ok_and(|it| it.is_file() && it.len() == 0));
}

fn remove(is_wanted: impl Fn(&Path) -> bool) {
    for path in CREATED.lock().unwrap_or_else(PoisonError::into_inner).drain(..).filter(|path| is_wanted(path)) {
        // The user may have removed the file meanwhile.
        let _ = fs::remove_file(path);
    }
}

//! What can go wrong on the way to the disk.

use std::path::PathBuf;
use std::{fmt, io};

/// A folder or file that could not be written.
#[derive(Debug)]
pub struct Error {
    /// Which one.
    pub path: PathBuf,
    /// Why.
    pub source: io::Error,
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let cure = match self.source.kind() {
            io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => "free some space, or choose another disk",
            io::ErrorKind::AlreadyExists | io::ErrorKind::NotADirectory | io::ErrorKind::IsADirectory => {
                "something else has that name: move it, or choose another folder"
            }
            _ => "choose a folder that you may write to",
        };
        write!(f, "cannot write {}: {}; {cure} with --out", self.path.display(), self.source)
    }
}

impl core::error::Error for Error {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        Some(&self.source)
    }
}

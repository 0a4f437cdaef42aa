//! Errors of writing results.

use std::path::PathBuf;
use std::{fmt, io};

/// Reason why a folder or file could not be written.
#[derive(Debug)]
pub enum Error {
    /// A folder or file that could not be written.
    Write {
        /// Path of the folder or file.
        path: PathBuf,
        /// Cause.
        source: io::Error,
    },
    /// A folder or file that the command did not write.
    Foreign {
        /// Path of the folder or file.
        path: PathBuf,
        /// The owner, in words.
        whose: String,
    },
    /// Another program is writing into the folder.
    Busy(PathBuf),
    /// A single file that exists already.
    Exists {
        /// Path of the file.
        path: PathBuf,
        /// Command-line option that names the file.
        option: &'static str,
        /// True if the command has `--force`.
        forcible: bool,
    },
    /// A single file that could not be written.
    File {
        /// Path of the file.
        path: PathBuf,
        /// Command-line option that names the file.
        option: &'static str,
        /// Description of the problem.
        problem: String,
    },
    /// The file that records the owner of a folder is damaged.
    Damaged {
        /// Path of the file.
        path: PathBuf,
        /// Description of the problem.
        problem: String,
    },
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::Write { path, source } => {
                let cure = match source.kind() {
                    io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
                        "free some space, or choose another disk"
                    }
                    io::ErrorKind::AlreadyExists | io::ErrorKind::NotADirectory | io::ErrorKind::IsADirectory => {
                        "the name is taken by something else: move that, or choose another folder"
                    }
                    _ => "choose a folder in which you may write",
                };
                write!(f, "cannot write {}: {source}; {cure} with --out", path.display())
            }
            Error::Foreign { path, whose } => write!(
                f,
                "{}: {whose}; choose another folder with --out, or replace its content with --force",
                path.display()
            ),
            Error::Busy(path) => write!(
                f,
                "{}: another program is writing into this folder; wait until the program ends, or choose another \
                 folder with --out",
                path.display()
            ),
            Error::Exists { path, option, forcible } => {
                let cure = if *forcible { "replace it with --force" } else { "remove that one" };
                write!(f, "{}: the file exists already; choose another file for {option}, or {cure}", path.display())
            }
            Error::File { path, option, problem } => {
                write!(
                    f,
                    "{}: the file cannot be written ({problem}); choose another file for {option}",
                    path.display()
                )
            }
            Error::Damaged { path, problem } => write!(
                f,
                "{}: the file is damaged ({problem}), so the owner of the folder is unknown; choose another folder \
                 with --out, or replace its content with --force",
                path.display()
            ),
        }
    }
}

impl core::error::Error for Error {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            Error::Write { source, .. } => Some(source),
            _ => None,
        }
    }
}

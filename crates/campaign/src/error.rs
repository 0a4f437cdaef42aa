//! Errors of campaigns, each displayed as one line.

use crate::manifest::Shard;
use afbc_files as files;
use afbc_types::OutOfRange;
use std::fmt;
use std::io;
use std::path::PathBuf;

/// Reason why a campaign has no results.
#[derive(Debug)]
pub enum Error {
    /// A value drawn for a flight is out of range.
    Draw {
        /// Index of the flight.
        flight: u64,
        /// The parameter out of range.
        error: OutOfRange,
    },
    /// A file cannot be read.
    Unreadable {
        /// Path of the file.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// A file was changed after it was written.
    Damaged {
        /// Path of the file.
        path: PathBuf,
        /// Description of the damage.
        problem: String,
    },
    /// The folder holds results of another campaign, vehicle, shard or program version.
    Changed(PathBuf),
    /// A shard has no results yet.
    Unfinished(PathBuf),
    /// Two folders hold results of different campaigns.
    Strangers([PathBuf; 2]),
    /// Two folders hold the same shard.
    Twice(Shard, [PathBuf; 2]),
    /// The output folder is one of the shards to be merged.
    IntoPart(PathBuf),
    /// No folder was given for these shards.
    Missing(Vec<Shard>),
    /// A file or folder could not be written.
    Output(files::Error),
    /// The user interrupted the campaign.
    Stopped,
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::Draw { flight, error } => {
                write!(f, "flight {flight} cannot be flown: {error}; narrow the spread that causes this")
            }
            Error::Unreadable { path, source } => {
                write!(f, "{}: the file cannot be read ({source}); make it readable, and start again", path.display())
            }
            Error::Damaged { path, problem } => {
                write!(
                    f,
                    "{}: the file is damaged ({problem}); delete it, and fly the campaign into its folder again",
                    path.display()
                )
            }
            Error::Changed(path) => write!(
                f,
                "{}: the folder holds results of another campaign, vehicle, shard or program; choose another folder \
                 with --out, or replace the results with --force",
                path.display()
            ),
            Error::Unfinished(path) => write!(
                f,
                "{}: the folder holds no finished results; fly the shard to its end with `sitl campaign --shard` first",
                path.display()
            ),
            Error::Strangers([a, b]) => write!(
                f,
                "{} and {}: the folders are parts of different campaigns; merge parts of the same campaign file, \
                 vehicle and program",
                a.display(),
                b.display()
            ),
            Error::Twice(shard, [a, b]) => {
                write!(f, "{} and {}: both folders hold shard {shard}; name only one of them", a.display(), b.display())
            }
            Error::Missing(shards) => {
                let names: Vec<_> = shards.iter().take(8).map(Shard::to_string).collect();
                let more = if shards.len() > names.len() {
                    format!(" and {} more", shards.len() - names.len())
                } else {
                    String::new()
                };
                write!(f, "shard {}{more} missing; fly it, or name its folder too", names.join(", "))
            }
            Error::IntoPart(path) => {
                write!(
                    f,
                    "{}: the folder is one of the parts; choose another folder for the merged results with --out",
                    path.display()
                )
            }
            Error::Output(error) => error.fmt(f),
            Error::Stopped => f.write_str("stopped"),
        }
    }
}

impl std::error::Error for Error {}

impl From<files::Error> for Error {
    fn from(error: files::Error) -> Self {
        Error::Output(error)
    }
}

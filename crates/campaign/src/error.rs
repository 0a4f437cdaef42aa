//! What can keep a campaign from its results, in one line.

use crate::manifest::Shard;
use afbc_files as files;
use afbc_types::OutOfRange;
use std::fmt;
use std::io;
use std::path::PathBuf;

/// One line for people.
#[derive(Debug)]
pub enum Error {
    /// A flight whose draw cannot be flown.
    Draw {
        /// Which.
        flight: u64,
        /// Why.
        error: OutOfRange,
    },
    /// A file that cannot be read at all.
    Unreadable {
        /// Which.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A file that is not what was written.
    Damaged {
        /// Which.
        path: PathBuf,
        /// Why.
        problem: String,
    },
    /// The folder holds results of something else.
    Changed(PathBuf),
    /// Another program is at work in the folder.
    Busy(PathBuf),
    /// A shard without results yet.
    Unfinished(PathBuf),
    /// Results of different campaigns.
    Strangers([PathBuf; 2]),
    /// Two folders with the same shard.
    Twice(Shard, [PathBuf; 2]),
    /// A shard that is to be merged into itself.
    IntoPart(PathBuf),
    /// Shards without a folder.
    Missing(Vec<Shard>),
    /// Something could not be written.
    Output(files::Error),
    /// Somebody has had enough.
    Stopped,
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::Draw { flight, error } => {
                write!(f, "flight {flight} cannot be flown: {error}; narrow the spread that leads there")
            }
            Error::Unreadable { path, source } => {
                write!(f, "{}: cannot be read ({source}); see that it can, and start again", path.display())
            }
            Error::Damaged { path, problem } => {
                write!(
                    f,
                    "{}: damaged ({problem}); delete it and fly that campaign into its folder again",
                    path.display()
                )
            }
            Error::Changed(path) => write!(
                f,
                "{}: holds results of a campaign, shard or program that is not this one; choose another folder with \
                 --out, or replace them with --force",
                path.display()
            ),
            Error::Busy(path) => {
                write!(
                    f,
                    "{}: another campaign is being flown into it; wait, or choose another with --out",
                    path.display()
                )
            }
            Error::Unfinished(path) => write!(
                f,
                "{}: no finished results in it; fly that shard to its end with `sitl campaign --shard` first",
                path.display()
            ),
            Error::Strangers([a, b]) => write!(
                f,
                "{} and {}: parts of different campaigns; merge those of one and the same file and program",
                a.display(),
                b.display()
            ),
            Error::Twice(shard, [a, b]) => {
                write!(f, "{} and {}: both hold shard {shard}; name one of them", a.display(), b.display())
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
                write!(f, "{}: one of the parts; choose another folder for the whole with --out", path.display())
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

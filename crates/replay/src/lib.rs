//! Runs the estimator on recorded flights and compares its estimate with the log's own.
//!
//! [`read`] turns a PX4 ULog or a PX4-ECL CSV into a [`Recording`] in this project's frames. [`fly`] runs the estimator
//! on a recording, one step per millisecond, and compares. No file makes this crate panic: unusable data are skipped,
//! counted and reported. [`exact`] replays a log of this firmware through all of its code. [`mcap`] converts a ULog for
//! other tools.
#![forbid(unsafe_code)]

mod aids;
mod compare;
mod compass;
mod earth;
mod ecl;
pub mod exact;
pub mod mcap;
mod order;
mod recording;
mod run;
mod states;
mod ulog;

pub use compare::{ErrorFigure, Figures};
pub use recording::{AidingSample, LoggedReset, LoggedState, Recording, SampleSource, Sensor};
pub use run::{EstimatorStart, ReplayRow, Replayed, fly};

use afbc_files::read::FileError;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Reads the log at `path`.
///
/// # Errors
/// One line, if the file cannot be read, is not a log, or has no IMU samples.
pub fn read(path: &Path) -> Result<Recording, FileError> {
    let shown = path.display().to_string();
    let failed = |problem: String| FileError::whole(&shown, problem);
    let bytes =
        bytes(path).map_err(|error| failed(format!("the log cannot be read ({error}); give the path of a log")))?;
    if exact::is_exact(&bytes) {
        return Err(failed("this is an exact log; replay it with --exact".into()));
    }
    let recording = match ulog::is_ulog(&bytes) {
        true => ulog::read(&bytes),
        false => ecl::read(&bytes, path),
    };
    recording.map_err(failed)
}

/// Largest log \[bytes\]: enough for days of flight. The limit keeps an endless file, such as a device, from filling
/// the memory.
const LOG_SIZE: u64 = 1 << 30;

/// Returns the contents of a file, if it is no larger than [`LOG_SIZE`].
fn bytes(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(LOG_SIZE + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > LOG_SIZE { Err(io::ErrorKind::FileTooLarge.into()) } else { Ok(bytes) }
}

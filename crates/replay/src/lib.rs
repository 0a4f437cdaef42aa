//! Recorded flights through the estimator, beside the estimate in the log.
//!
//! [`read`] makes a [`Recording`] of a PX4 ULog or a PX4-ECL CSV, in this project's frames; [`fly`] runs the estimator
//! over it, a step a millisecond, and compares. Whatever is in a file, nothing here panics: what cannot be used is
//! skipped, counted and reported. [`exact`] runs a log of this firmware through all of its code.
//! [`mcap`] converts a ULog for other tools.
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
pub use recording::{Aiding, LoggedReset, LoggedState, Recording, SampleSource, Sensor};
pub use run::{EstimatorStart, ReplayRow, Replayed, fly};

use afbc_files::read::FileError;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Reads the log at `path`.
///
/// # Errors
/// One line, if it cannot be read, is not a log, or has no samples of an inertial sensor.
pub fn read(path: &Path) -> Result<Recording, FileError> {
    let shown = path.display().to_string();
    let failed = |problem: String| FileError::whole(&shown, problem);
    let bytes = bytes(path).map_err(|error| failed(format!("cannot be read ({error}); give the path of a log")))?;
    if exact::is_exact(&bytes) {
        return Err(failed("this is an exact log; replay it with --exact".into()));
    }
    let recording = match ulog::is_ulog(&bytes) {
        true => ulog::read(&bytes),
        false => ecl::read(&bytes, path),
    };
    recording.map_err(failed)
}

/// Largest log \[bytes\]: days of a flight. What has no end, such as a device, must not fill the memory.
const LOG_SIZE: u64 = 1 << 30;

/// Returns what is in a file, if it is no larger than a log.
fn bytes(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(LOG_SIZE + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > LOG_SIZE { Err(io::ErrorKind::FileTooLarge.into()) } else { Ok(bytes) }
}

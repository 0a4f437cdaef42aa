//! Helpers for the tests of both images.

use pil::{Error, FirmwareImage};
use std::io::Write as _;
use std::path::PathBuf;

/// Starts the image. Returns none, with a message on the terminal, if the test must be skipped. In CI nothing may be
/// skipped.
pub fn start_or_skip<T>(image: FirmwareImage, start: impl FnOnce(PathBuf) -> Result<T, Error>) -> Option<T> {
    match image.find().and_then(start) {
        Ok(started) => Some(started),
        Err(error) if error.is_missing() && std::env::var_os("CI").is_none() => {
            // The test harness would hide the text of println!.
            let _ = writeln!(std::io::stderr(), "SKIPPED, nothing was tested: {error}");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

//! What the tests of both images share.

use pil::{Error, Image};
use std::io::Write as _;
use std::path::PathBuf;

/// The image, started, or none if this test has to be skipped, which it says on the terminal. Under CI nothing may be
/// skipped.
pub fn start_or_skip<T>(image: Image, start: impl FnOnce(PathBuf) -> Result<T, Error>) -> Option<T> {
    match image.find().and_then(start) {
        Ok(started) => Some(started),
        Err(error) if error.is_missing() && std::env::var_os("CI").is_none() => {
            // Not println!: the test harness would hide it.
            let _ = writeln!(std::io::stderr(), "SKIPPED, nothing was tested: {error}");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

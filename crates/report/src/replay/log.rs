//! The input of a replay's report.

use afbc_replay::{Recording, Replayed};

/// A log with the result of its replay.
#[derive(Clone, Copy, Debug)]
pub struct ReplayedRecording<'a> {
    /// Name of the log.
    pub name: &'a str,
    /// Contents of the log.
    pub recording: &'a Recording,
    /// Our estimate and the log's, compared.
    pub replayed: &'a Replayed,
}

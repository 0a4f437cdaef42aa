//! The input of a report on an exact log.

use afbc_replay::exact::ExactReplay;

/// An exact log with the result of its replay.
#[derive(Clone, Copy, Debug)]
pub struct ReplayedLog<'a> {
    /// Name of the log.
    pub name: &'a str,
    /// Result of the replay.
    pub replay: &'a ExactReplay,
}

//! What a report is on.

use afbc_replay::exact::ExactReplay;

/// An exact log, replayed.
#[derive(Clone, Copy, Debug)]
pub struct ReplayedLog<'a> {
    /// Name of the log.
    pub name: &'a str,
    /// What was found.
    pub replay: &'a ExactReplay,
}

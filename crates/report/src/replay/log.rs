//! What is replayed.

use afbc_replay::{Recording, Replayed};

/// A log and what the estimator made of it.
#[derive(Clone, Copy, Debug)]
pub struct Replay<'a> {
    /// Name of the log.
    pub name: &'a str,
    /// What it holds.
    pub recording: &'a Recording,
    /// Our estimate beside its own.
    pub replayed: &'a Replayed,
}

//! The flown flights, grouped by class.

use afbc_campaign::rough::{ClassRow, FlownRough, Rough, rows};

/// The flown flights, and a row of results per class.
#[derive(Clone, Debug)]
pub struct RoughResults<'a> {
    /// Settings from which the flights were drawn.
    pub rough: &'a Rough,
    /// The flights with their results.
    pub flown: &'a [FlownRough],
    pub(super) rows: Vec<ClassRow>,
}

impl<'a> RoughResults<'a> {
    /// Summarises the flights by class.
    pub fn new(rough: &'a Rough, flown: &'a [FlownRough]) -> Self {
        RoughResults { rough, flown, rows: rows(flown) }
    }
}

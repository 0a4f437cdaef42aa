//! Flights that were drawn and flown, by their classes.

use afbc_campaign::rough::{ClassRow, FlownRough, Rough, rows};

/// Flights that were drawn and flown, and a row for each class.
#[derive(Clone, Debug)]
pub struct RoughResults<'a> {
    /// The suite as it was drawn.
    pub rough: &'a Rough,
    /// The flights.
    pub flown: &'a [FlownRough],
    pub(super) rows: Vec<ClassRow>,
}

impl<'a> RoughResults<'a> {
    /// Judges the flights by their classes.
    pub fn new(rough: &'a Rough, flown: &'a [FlownRough]) -> Self {
        RoughResults { rough, flown, rows: rows(flown) }
    }
}

//! The flown flights, grouped by class.

use afbc_campaign::rough::{ClassRow, FlownRoughFlight, RoughFlights, rows};

/// The flown flights, and a row of results per class.
#[derive(Clone, Debug)]
pub struct RoughResults<'a> {
    /// Settings from which the flights were drawn.
    pub rough: &'a RoughFlights,
    /// The flights with their results.
    pub flown: &'a [FlownRoughFlight],
    pub(super) rows: Vec<ClassRow>,
}

impl<'a> RoughResults<'a> {
    /// Summarises the flights by class.
    pub fn new(rough: &'a RoughFlights, flown: &'a [FlownRoughFlight]) -> Self {
        RoughResults { rough, flown, rows: rows(flown) }
    }
}

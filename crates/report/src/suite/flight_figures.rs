//! Figures of a suite's flights.

use crate::explore::ExplorableScene;
use crate::figures::{self, Picture};
use afbc_campaign::compare::Comparison;

/// Figures of one flight on the page.
pub(super) struct FlightFigures {
    pub(super) errors: Option<Picture>,
    pub(super) space: Option<ExplorableScene>,
}

impl FlightFigures {
    pub(super) fn of(comparison: &Comparison) -> Self {
        let flights: Vec<_> = comparison.entries.iter().map(|entry| &entry.first).collect();
        let names = [("fig7-errors", "errors"), ("fig4-trajectory", "trajectory")];
        let mut pictures = figures::flights::named(&flights, &names).into_iter();
        FlightFigures { errors: pictures.next(), space: pictures.next().and_then(Picture::into_scene) }
    }
}

//! Flights that the page shows in space.

use crate::explore::ExplorableScene;
use crate::figures::{self, Picture};
use crate::words;
use afbc_campaign::compare::Comparison;

/// A flight that the page shows in space.
pub(super) struct ShownFlight {
    pub(super) name: String,
    pub(super) conditions: String,
    pub(super) space: Option<ExplorableScene>,
}

impl ShownFlight {
    pub(super) fn of(again: &Comparison) -> Self {
        let Comparison { scenario, entries, .. } = again;
        let flights: Vec<_> = entries.iter().map(|entry| &entry.first).collect();
        let drawn = figures::flights::named(&flights, &[("fig4-trajectory", "trajectory")]).pop();
        let (name, conditions) = (scenario.name.clone(), words::conditions(scenario));
        ShownFlight { name, conditions, space: drawn.and_then(Picture::into_scene) }
    }
}

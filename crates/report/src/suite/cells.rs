//! Contents of a suite's tables.

use afbc_campaign::compare::{Comparison, ContenderFlights, DISTANCE, Measure};
use core::fmt::Write;

/// A figure of merit.
pub(super) struct SuiteFigure {
    /// Heading of the figure's table.
    pub(super) title: &'static str,
    pub(super) measure: Measure,
}

/// The suite's figures of merit, each with its own table.
pub(super) const FIGURES: [SuiteFigure; 3] = [
    SuiteFigure {
        title: "Root mean square distance from the reference [m]",
        measure: Measure { digits: 4, ..DISTANCE },
    },
    SuiteFigure {
        title: "Largest distance from the reference [m]",
        measure: Measure {
            name: "largest_m",
            title: "largest [m]",
            digits: 3,
            scale: 1.0,
            value: |m| m.max_distance_m,
        },
    },
    SuiteFigure {
        title: "Mean absolute change of an input per step, over U₁ to U₄ [mN]",
        measure: Measure {
            name: "mean_abs_delta_u_n",
            title: "|ΔU| [mN]",
            digits: 1,
            scale: 1000.0,
            value: |m| m.mean_abs_delta_u.mean(),
        },
    },
];

impl SuiteFigure {
    /// Returns the median over a contender's flights as text; `None` if the median is a lost flight's.
    pub(super) fn text(&self, entry: &ContenderFlights) -> Option<String> {
        let Measure { digits, scale, value, .. } = self.measure;
        let median = scale * entry.median(value)?.value;
        Some(if median < 1e4 { format!("{median:.digits$}") } else { format!("{median:.1e}") })
    }

    /// Returns true if no other contender has a smaller median.
    pub(super) fn is_best(&self, comparison: &Comparison, entry: &ContenderFlights) -> bool {
        comparison.is_best(entry, &self.measure)
    }
}

/// Says when the vehicle was lost ("lost 6.2 s") or, for several flights, how many were lost. `None` without a loss.
pub(super) fn lost(entry: &ContenderFlights) -> Option<String> {
    let first = entry.flights.iter().find_map(|flight| flight.lost)?;
    let of = entry.flights.len();
    Some(if of > 1 { format!("{} of {of} lost", entry.lost()) } else { format!("lost {:.1} s", first.time_s) })
}

/// Says when and why the monitor switched to the fallback law: "trip 10.3 s: errors of x stay large". For several
/// flights it says how often, and describes the first trip. `None` without a trip.
pub(super) fn trip(entry: &ContenderFlights) -> Option<String> {
    let mut trips = entry.flights.iter().filter_map(|flight| flight.tripped);
    let (first, others) = (trips.next()?, trips.count());
    let reason = first.reason;
    let reason = reason.strip_prefix("AFBC off: ").unwrap_or(reason);
    let of = entry.flights.len();
    let when = if of > 1 { format!("{} of {of} trip, first", others + 1) } else { "trip".into() };
    Some(format!("{when} {:.1} s: {reason}", first.time_s))
}

/// Summarises a contender in one cell: the trip, then the loss or the root mean square and largest distance.
pub(super) fn summary(entry: &ContenderFlights) -> String {
    let mut words = trip(entry).map_or(String::new(), |trip| trip + "; ");
    let [rms, largest, _] = FIGURES.each_ref().map(|figure| figure.text(entry));
    let end = lost(entry).or_else(|| Some(format!("{} / {}", rms?, largest?)));
    // Writing to a String cannot fail.
    let _ = write!(words, "{}", end.unwrap_or_default());
    words
}

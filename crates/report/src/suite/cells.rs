//! Contents of a suite's tables.

use afbc_campaign::compare::{Comparison, Entry};
use afbc_sim::metrics::Metrics;
use core::fmt::Write;

/// A figure of merit; smaller is better.
pub(super) struct Figure {
    /// Name in files.
    pub(super) name: &'static str,
    /// Heading of its table.
    pub(super) title: &'static str,
    /// Decimals in tables, in which it is multiplied by `scale`.
    digits: usize,
    scale: f64,
    /// Computes it from the metrics of a flight.
    pub(super) value: fn(&Metrics) -> f64,
}

/// The figures of a suite, a table each.
pub(super) const FIGURES: [Figure; 3] = [
    Figure {
        name: "rms_m",
        title: "Root mean square distance from the reference [m]",
        digits: 4,
        scale: 1.0,
        value: |m| m.rmse.xyz().norm(),
    },
    Figure {
        name: "largest_m",
        title: "Largest distance from the reference [m]",
        digits: 3,
        scale: 1.0,
        value: |m| m.max_distance_m,
    },
    Figure {
        name: "mean_abs_delta_u_n",
        title: "Mean absolute change of an input per step, over U₁ to U₄ [mN]",
        digits: 1,
        scale: 1000.0,
        value: |m| m.mean_abs_delta_u.mean(),
    },
];

impl Figure {
    /// Returns the mean over a contender's flights as text; none if it lost a vehicle.
    pub(super) fn text(&self, entry: &Entry) -> Option<String> {
        let mean = self.scale * entry.average(self.value)?.mean;
        Some(if mean < 1e4 { format!("{mean:.0$}", self.digits) } else { format!("{mean:.1e}") })
    }

    /// True if no other contender has a smaller mean.
    pub(super) fn is_best(&self, comparison: &Comparison, entry: &Entry) -> bool {
        let mean = |entry: &Entry| entry.average(self.value).map(|average| average.mean);
        mean(entry).is_some_and(|own| comparison.entries.iter().filter_map(mean).all(|other| own <= other))
    }
}

/// Says when the vehicle was lost, or how many of several were, if any: "lost 6.2 s".
pub(super) fn lost(entry: &Entry) -> Option<String> {
    let first = entry.flights.iter().find_map(|flight| flight.lost)?;
    let of = entry.flights.len();
    Some(if of > 1 { format!("{} of {of} lost", entry.lost()) } else { format!("lost {:.1} s", first.time_s) })
}

/// Says when and why the monitor switched to the fallback law, or in how many of several flights and why first, if it
/// did: "trip 10.3 s: errors of x stay large".
pub(super) fn trip(entry: &Entry) -> Option<String> {
    let mut trips = entry.flights.iter().filter_map(|flight| flight.tripped);
    let (first, others) = (trips.next()?, trips.count());
    let reason = first.reason;
    let reason = reason.strip_prefix("AFBC off: ").unwrap_or(reason);
    let of = entry.flights.len();
    let when = if of > 1 { format!("{} of {of} trip, first", others + 1) } else { "trip".into() };
    Some(format!("{when} {:.1} s: {reason}", first.time_s))
}

/// Returns everything about a contender in one cell: trip, then loss, or root mean square and largest distance.
pub(super) fn summary(entry: &Entry) -> String {
    let mut words = trip(entry).map_or(String::new(), |trip| trip + "; ");
    let [rms, largest, _] = FIGURES.each_ref().map(|figure| figure.text(entry));
    let end = lost(entry).or_else(|| Some(format!("{} / {}", rms?, largest?)));
    // Writing to a String cannot fail.
    let _ = write!(words, "{}", end.unwrap_or_default());
    words
}

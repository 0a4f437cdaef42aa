//! Contents of the tables, and their explanation.

use super::results::{RandomResults, VehicleGroup};
use afbc_campaign::random::{RESAMPLES, Ranking, RankingDifference};
use afbc_sim::metrics::SETTLED_S;

/// Column heads without the contender's. The reference contender's name is appended to the last head.
pub(super) const HEADS: [&str; 6] = ["best or level", "lost", "alone", "median [m]", "geometric [m]", "over"];

/// Returns the column heads.
pub(super) fn heads(judged: &RandomResults<'_>) -> [String; HEADS.len()] {
    let mut heads = HEADS.map(String::from);
    if let Some(last) = heads.last_mut() {
        *last = format!("{last} {} [95 %]", judged.baseline());
    }
    heads
}

/// Returns a contender's cells.
pub(super) fn cells(group: &VehicleGroup<'_>, ranking: &Ranking) -> [String; HEADS.len()] {
    let Ranking { wins, lost, lost_alone, median_m, geometric_m, difference } = ranking;
    let percent = 100.0 * *wins as f64 / group.kept().max(1) as f64;
    let metres = |distance_m: &Option<f64>| distance_m.map_or("lost".into(), |distance_m| format!("{distance_m:.5}"));
    [
        format!("{wins} ({percent:.0} %)"),
        lost.to_string(),
        lost_alone.to_string(),
        metres(median_m),
        metres(geometric_m),
        difference.as_ref().map_or(String::new(), ratio),
    ]
}

/// Formats a difference of logarithms as a ratio with its interval: "1.12 [1.05, 1.20]".
fn ratio(difference: &RankingDifference) -> String {
    let of = |log: f64| format!("{:.2}", libm::exp(log));
    let interval = difference.interval.map_or(String::new(), |[low, high]| format!(" [{}, {}]", of(low), of(high)));
    of(difference.mean) + &interval
}

/// Explains the columns.
pub(super) fn legend(judged: &RandomResults<'_>) -> String {
    let baseline = judged.baseline();
    format!(
        "Figures of the root mean square distance from the reference, from {SETTLED_S} s to the end. best or level: \
         flights in which a law is best, or within 5 % or 0.2 mm of the best, and their share of the flights that not \
         every law loses. lost: vehicles lost. alone: of these, those that another law does not lose. median: over all \
         flights, lost ones last. geometric: geometric mean over the flights that the law keeps. over {baseline}: \
         geometric mean of the law's distance over that of {baseline} in the flights that both keep, above 1 \
         where {baseline} is nearer, with its 95 % interval ({RESAMPLES} resamples, clustered by seed)."
    )
}

/// Returns the notes below a group: the flights that every law loses, and those that only the reference contender
/// loses.
pub(super) fn notes(judged: &RandomResults<'_>, group: &VehicleGroup<'_>) -> Vec<String> {
    let baseline = judged.baseline();
    [
        (&group.lost_by_all, "Every law loses".into()),
        (&group.lost_alone, format!("{baseline} loses the vehicle, another law does not")),
    ]
    .into_iter()
    .filter(|(flights, _)| !flights.is_empty())
    .map(|(flights, what): (_, String)| format!("{what}: {}.", named(flights)))
    .collect()
}

/// Names up to twenty flights.
fn named(flights: &[&str]) -> String {
    const SOME: usize = 20;
    let names = flights.iter().take(SOME).copied().collect::<Vec<_>>().join(", ");
    let more = flights.len().saturating_sub(SOME);
    if more > 0 { format!("{names} and {more} more") } else { names }
}

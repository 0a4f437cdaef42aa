//! Search for the best gains.

use crate::cma_es::Search;
use crate::conditions::{Condition, factor};
use crate::cost::{LOST, costs, mean};
use crate::gains::{self, Change};
use afbc_sim::contender::Contender;
use afbc_sim::scenario::Scenario;
use afbc_types::OutOfRange;
use rayon::prelude::*;

/// Initial step size in the logarithm of every gain of a search from hand-tuned gains: about a third up or down.
pub const STEP: f64 = 0.3;

/// How a search goes.
#[derive(Clone, Copy, Debug)]
pub struct Course {
    /// Number of contenders to try, including the start.
    pub budget: usize,
    /// Initial step size in the logarithm of every gain, such as [`STEP`].
    pub step: f64,
    /// Seed; the same seed finds the same gains.
    pub seed: u64,
}

/// Result of a search.
#[derive(Clone, Debug)]
pub struct Found {
    /// The best contender; the start, if none was better.
    pub contender: Contender,
    /// Cost of the start, times the factors of the conditions that it does not meet.
    pub before: f64,
    /// The same of the best contender.
    pub after: f64,
    /// Number of contenders tried.
    pub evaluations: usize,
    /// Every gain searched.
    pub changes: Vec<Change>,
}

/// Searches for the gains of `start` with the lowest cost over `flights` that meet `conditions`. `progress` is called
/// with the number of tries and the lowest cost so far, and ends the search by returning false. The result does not
/// depend on the number of threads.
///
/// # Errors
/// If `start` cannot fly.
pub fn search(
    start: &Contender,
    flights: &[Scenario],
    conditions: &[Condition],
    Course { budget, step, seed }: Course,
    mut progress: impl FnMut(usize, f64) -> bool,
) -> Result<Found, OutOfRange> {
    let rate = |contender: &Contender| Ok(mean(&costs(flights, contender)?) * factor(conditions, contender)?);
    let before = rate(start)?;
    let (mut best, mut after, mut evaluations) = (start.clone(), before, 1);
    let mut search = Search::new(&gains::point(start), step, seed);
    // The mean of the search is often better than any point around it: the last try is reserved for it, once it has
    // moved.
    let mut kept = 0;
    while evaluations + kept < budget && progress(evaluations, after) {
        // The last generation has as many points as there are tries left.
        let mut points = search.ask();
        points.truncate(budget - kept - evaluations);
        let is_whole = points.len() == search.population();
        let generation = rated(start, rate, points);
        evaluations += generation.len();
        if let Some((cost, contender, _)) = generation.first().filter(|(cost, ..)| *cost < after) {
            (best, after) = (contender.clone(), *cost);
        }
        let points: Vec<_> = generation.into_iter().map(|(_, _, point)| point).collect();
        if is_whole {
            search.tell(&points);
            kept = 1;
        }
    }
    if evaluations + kept <= budget && kept > 0 {
        let last = rated(start, rate, vec![search.mean()]);
        evaluations += last.len();
        if let Some((cost, contender, _)) = last.into_iter().find(|(cost, ..)| *cost < after) {
            (best, after) = (contender, cost);
        }
    }
    progress(evaluations, after);
    let changes = gains::changes(start, &best);
    Ok(Found { contender: best, before, after, evaluations, changes })
}

/// Returns contenders with the gains of `points` and their costs by `rate`, best first.
fn rated(
    start: &Contender,
    rate: impl Fn(&Contender) -> Result<f64, OutOfRange> + Sync,
    points: Vec<Vec<f64>>,
) -> Vec<(f64, Contender, Vec<f64>)> {
    let rated = |mut point: Vec<f64>| {
        let contender = gains::contender(start, &mut point);
        // Invalid combinations of gains cost as much as a flight lost at its start.
        (rate(&contender).unwrap_or(2.0 * LOST), contender, point)
    };
    let mut rated: Vec<_> = points.into_par_iter().map(rated).collect();
    rated.sort_by(|(a, ..), (b, ..)| a.total_cmp(b));
    rated
}

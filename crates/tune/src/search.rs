//! The search.

use crate::cma_es::Search;
use crate::cost::{LOST, costs, mean};
use crate::gains::{self, Change};
use afbc_sim::contender::Contender;
use afbc_sim::scenario::Scenario;
use afbc_types::OutOfRange;
use rayon::prelude::*;

/// First step of the search, in every gain's logarithm: by a third, up or down.
const STEP: f64 = 0.3;

/// What a search has found.
#[derive(Clone, Debug)]
pub struct Found {
    /// The best contender; the one that it started from, if none was better.
    pub contender: Contender,
    /// Cost of the start.
    pub before: f64,
    /// Cost of the best.
    pub after: f64,
    /// How many contenders were tried.
    pub evaluations: usize,
    /// Every gain that was searched.
    pub changes: Vec<Change>,
}

/// Searches for the gains of `start` that cost least over `scenarios`, trying `budget` contenders, `start` included.
/// `progress` hears how many have been tried and the least cost so far; if it returns false, the search ends
/// there. What is found is the same however many threads there are.
///
/// # Errors
/// If `start` cannot fly.
pub fn search(
    start: &Contender,
    scenarios: &[Scenario],
    budget: usize,
    seed: u64,
    mut progress: impl FnMut(usize, f64) -> bool,
) -> Result<Found, OutOfRange> {
    let before = mean(&costs(scenarios, start)?);
    let (mut best, mut after, mut evaluations) = (start.clone(), before, 1);
    let mut search = Search::new(&gains::point(start), STEP, seed);
    // The middle of the search is often better than any point around it: the last try is kept for it, once it has moved.
    let mut kept = 0;
    while evaluations + kept < budget && progress(evaluations, after) {
        // Of the last generation as many points as there are tries left.
        let mut points = search.ask();
        points.truncate(budget - kept - evaluations);
        let is_whole = points.len() == search.population();
        let generation = rated(start, scenarios, points);
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
        let last = rated(start, scenarios, vec![search.mean()]);
        evaluations += last.len();
        if let Some((cost, contender, _)) = last.into_iter().find(|(cost, ..)| *cost < after) {
            (best, after) = (contender, cost);
        }
    }
    progress(evaluations, after);
    let changes = gains::changes(start, &best);
    Ok(Found { contender: best, before, after, evaluations, changes })
}

/// Contenders with the gains of `points`, and what they cost, the best first.
fn rated(start: &Contender, scenarios: &[Scenario], points: Vec<Vec<f64>>) -> Vec<(f64, Contender, Vec<f64>)> {
    let rate = |mut point: Vec<f64>| {
        let contender = gains::contender(start, &mut point);
        // Gains that do not go together cost as much as a flight that ends where it begins.
        let cost = costs(scenarios, &contender).map_or(2.0 * LOST, |costs| mean(&costs));
        (cost, contender, point)
    };
    let mut rated: Vec<_> = points.into_par_iter().map(rate).collect();
    rated.sort_by(|(a, ..), (b, ..)| a.total_cmp(b));
    rated
}

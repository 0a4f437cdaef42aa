//! Finding gains, in one way for every law: the same flights, the same cost, the same search, the same effort.
//!
//! `docs/tuning.md` says what that is and what came of it.

mod cma_es;
mod flights;
mod gains;
mod report;
mod start;

pub use flights::{held_out, training};
pub use gains::{Change, fragment};
pub use report::report;
pub use start::by_hand;

use crate::metrics::Metrics;
use crate::run::Run;
use crate::scenario::{Contender, Scenario};
use afbc_types::OutOfRange;
use cma_es::Search;
use rayon::prelude::*;

/// First step of the search, in every gain's logarithm: by a third, up or down.
const STEP: f64 = 0.3;

/// Root mean square distance from the reference that costs as much as 1 of the others \[m\].
pub const POSITION_M: f64 = 0.1;
/// Likewise, largest error along x, y and z, together \[m\].
pub const WORST_M: f64 = 0.3;
/// Likewise, root mean square error of yaw \[rad\].
pub const YAW_RAD: f64 = 0.1;
/// Likewise, sum over U1..U4 of the mean |change| from step to step \[N\].
pub const JUMP_N: f64 = 0.2;
/// Cost of a flight that is lost at its end, or in which the monitor ends the law's; the earlier, the more, up to twice that.
pub const LOST: f64 = 100.0;

/// What one flight costs.
pub fn cost(scenario: &Scenario, run: &Run) -> f64 {
    let tripped_s = run.tripped.map(|tripped| tripped.time_s);
    if let Some(end_s) = run.lost.map(|lost| lost.time_s).or(tripped_s) {
        return LOST * (2.0 - end_s / scenario.duration_s);
    }
    let Metrics { rmse, max_abs, mean_abs_delta_u: jumps, .. } = &run.metrics;
    let errors = rmse.xyz().norm() / POSITION_M + rmse.w / YAW_RAD;
    errors + max_abs.xyz().norm() / WORST_M + jumps.sum() / JUMP_N
}

/// What each of `scenarios` costs under `contender`.
///
/// # Errors
/// The first parameter, gain or setting out of range.
pub fn costs(scenarios: &[Scenario], contender: &Contender) -> Result<Vec<f64>, OutOfRange> {
    let fly = |scenario| Run::fly(scenario, contender, u64::MAX).map(|run| cost(scenario, &run));
    scenarios.par_iter().map(fly).collect()
}

/// The mean over flights: what a contender is judged by.
pub fn mean(costs: &[f64]) -> f64 {
    costs.iter().sum::<f64>() / costs.len() as f64
}

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

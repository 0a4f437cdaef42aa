//! Search for the best gains.

use crate::cma_es::Search;
use crate::conditions::{Condition, FAILED, factor};
use crate::cost::{LOST, costs, flown, mean};
use crate::gains::{self, GainChange};
use afbc_scenario::Scenario;
use afbc_scenario::contender::Contender;
use afbc_types::OutOfRange;
use rayon::prelude::*;

/// Initial step size in the logarithm of every gain of a search from hand-tuned gains: about a third up or down.
pub const STEP: f64 = 0.3;

/// How a search goes.
#[derive(Clone, Copy, Debug)]
pub struct SearchOptions {
    /// Number of contenders to try, including the start.
    pub budget: usize,
    /// Initial step size in the logarithm of every gain, such as [`STEP`].
    pub step: f64,
    /// Seed; the same seed finds the same gains.
    pub seed: u64,
}

/// Result of a search.
#[derive(Clone, Debug)]
pub struct SearchResult {
    /// The best contender; the start, if none was better.
    pub contender: Contender,
    /// Cost of the start, times the factors of the conditions that it does not meet.
    pub before: f64,
    /// The same of the best contender.
    pub after: f64,
    /// Number of contenders tried.
    pub evaluations: usize,
    /// Every gain searched.
    pub changes: Vec<GainChange>,
}

/// Searches for the gains of `start` with the lowest cost over `flights` that meet `conditions`. `progress` is called
/// with the number of tries and the lowest cost so far, and ends the search by returning false. The result does not
/// depend on the number of threads.
///
/// A contender that loses more flights than the best one so far is given up: the flights not flown count as lost at
/// their start, and no condition as met. So that this comes early, those flights come first that cost `start` most.
///
/// # Errors
/// If `start` cannot fly.
pub fn search(
    start: &Contender,
    flights: &[Scenario],
    conditions: &[Condition],
    SearchOptions { budget, step, seed }: SearchOptions,
    mut progress: impl FnMut(usize, f64) -> bool,
) -> Result<SearchResult, OutOfRange> {
    let rate =
        |contender: &Contender| Ok::<_, OutOfRange>((costs(flights, contender)?, factor(conditions, contender)?));
    let of = |(costs, factor): &(Vec<f64>, f64)| mean(costs) * factor;
    let first = rate(start)?;
    let before = of(&first);
    let mut trial = Trial { flights, conditions, order: order(&first.0), bearable: lost(&first.0) };
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
        let generation = rated(start, &trial, points);
        evaluations += generation.len();
        if let Some(Rated { costs, contender, cost, .. }) =
            generation.first().filter(|rated| !rated.given_up && rated.cost < after)
        {
            (best, after, trial.bearable) = (contender.clone(), *cost, lost(costs));
        }
        let points: Vec<_> = generation.into_iter().map(|rated| rated.point).collect();
        if is_whole {
            search.tell(&points);
            kept = 1;
        }
    }
    if evaluations + kept <= budget && kept > 0 {
        let last = gains::contender(start, &mut search.mean());
        evaluations += 1;
        // An invalid combination of gains is no result.
        if let Some(cost) = rate(&last).ok().map(|rated| of(&rated)).filter(|cost| *cost < after) {
            (best, after) = (last, cost);
        }
    }
    progress(evaluations, after);
    let changes = gains::changes(start, &best);
    Ok(SearchResult { contender: best, before, after, evaluations, changes })
}

/// Returns the indices of flights with these costs, the dearest first.
fn order(costs: &[f64]) -> Vec<usize> {
    let mut order: Vec<_> = (0..costs.len()).collect();
    let cost = |index: &usize| costs.get(*index).copied().unwrap_or(0.0);
    order.sort_by(|a, b| cost(b).total_cmp(&cost(a)));
    order
}

/// Returns how many flights with these costs are lost.
fn lost(costs: &[f64]) -> usize {
    costs.iter().filter(|cost| **cost >= LOST).count()
}

/// What each contender has to fly.
struct Trial<'a> {
    flights: &'a [Scenario],
    conditions: &'a [Condition],
    /// Indices of the flights, as they are flown.
    order: Vec<usize>,
    /// Number of flights that may be lost.
    bearable: usize,
}

/// A contender with its costs.
struct Rated {
    cost: f64,
    costs: Vec<f64>,
    given_up: bool,
    contender: Contender,
    point: Vec<f64>,
}

impl Trial<'_> {
    /// Returns the cost of `contender`, that of each flight, and whether it was given up.
    fn rate(&self, contender: &Contender) -> Result<(f64, Vec<f64>, bool), OutOfRange> {
        let mut costs = vec![2.0 * LOST; self.flights.len()];
        let mut losses = 0;
        for &index in &self.order {
            let (Some(scenario), Some(cost)) = (self.flights.get(index), costs.get_mut(index)) else { continue };
            // One flight after the other: contenders are rated side by side, and one that is given up saves the rest.
            *cost = flown(scenario, contender)?;
            losses += usize::from(*cost >= LOST);
            if losses > self.bearable {
                let asked = self.conditions.iter().filter(|condition| condition.is_asked_of(contender.kind())).count();
                let factor: f64 = std::iter::repeat_n(FAILED, asked).product();
                return Ok((mean(&costs) * factor, costs, true));
            }
        }
        Ok((mean(&costs) * factor(self.conditions, contender)?, costs, false))
    }
}

/// Returns contenders with the gains of `points` and their costs, best first.
fn rated(start: &Contender, trial: &Trial<'_>, points: Vec<Vec<f64>>) -> Vec<Rated> {
    let rated = |mut point: Vec<f64>| {
        let contender = gains::contender(start, &mut point);
        // Invalid combinations of gains cost more than any other.
        let (cost, costs, given_up) = trial.rate(&contender).unwrap_or((f64::MAX, Vec::new(), true));
        Rated { cost, costs, given_up, contender, point }
    };
    let mut rated: Vec<_> = points.into_par_iter().map(rated).collect();
    rated.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    rated
}

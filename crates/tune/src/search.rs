//! Search for the best gains.

use crate::cma_es::CmaEs;
use crate::conditions::{Condition, FAILED, factor};
use crate::cost::{LOST, costs, flown, mean};
use crate::gains::{self, GainChange};
use afbc_scenario::Scenario;
use afbc_scenario::contender::Contender;
use afbc_types::OutOfRange;
use rayon::prelude::*;

/// Initial step size of a search from hand-tuned gains, in the logarithm of every gain: about a third up or down.
pub const STEP: f64 = 0.3;

/// Options of a search.
#[derive(Clone, Copy, Debug)]
pub struct SearchOptions {
    /// Number of contenders to try, including the start.
    pub budget: usize,
    /// Initial step size in the logarithm of every gain, such as [`STEP`].
    pub step: f64,
    /// Seed of the search. The same seed finds the same gains.
    pub seed: u64,
}

/// Result of a search.
#[derive(Clone, Debug)]
pub struct SearchResult {
    /// Best contender found, which is the start if no other was better.
    pub contender: Contender,
    /// Cost of the start, times the factors of the conditions.
    pub before: f64,
    /// Cost of the best contender, times the factors of the conditions.
    pub after: f64,
    /// Number of contenders tried.
    pub evaluations: usize,
    /// Every searched gain, before and after.
    pub changes: Vec<GainChange>,
}

/// Searches for the gains of `start` that have the lowest cost over `flights` and meet `conditions`. Calls `progress`
/// with the number of tries and the lowest cost so far; if it returns false, the search ends. The result does not
/// depend on the number of threads.
///
/// A contender that loses more flights than the best one so far is given up. Its remaining flights count as lost at
/// their start, and its conditions as not met. The flights that cost `start` most come first, so that bad contenders
/// are given up early.
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
    let mut search = CmaEs::new(&gains::point(start), step, seed);
    // The mean of the search is often better than any point around it. Once the mean has moved, the last try is
    // reserved for it.
    let mut kept = 0;
    while evaluations + kept < budget && progress(evaluations, after) {
        // The last generation has only as many points as there are tries left.
        let mut points = search.ask();
        points.truncate(budget - kept - evaluations);
        let is_whole = points.len() == search.population();
        let generation = rated(start, &trial, points);
        evaluations += generation.len();
        if let Some(RatedContender { costs, contender, cost, .. }) =
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
        // A mean whose gains are an invalid combination is ignored.
        if let Some(cost) = rate(&last).ok().map(|rated| of(&rated)).filter(|cost| *cost < after) {
            (best, after) = (last, cost);
        }
    }
    progress(evaluations, after);
    let changes = gains::changes(start, &best);
    Ok(SearchResult { contender: best, before, after, evaluations, changes })
}

/// Returns the indices of the flights by falling cost.
fn order(costs: &[f64]) -> Vec<usize> {
    let mut order: Vec<_> = (0..costs.len()).collect();
    let cost = |index: &usize| costs.get(*index).copied().unwrap_or(0.0);
    order.sort_by(|a, b| cost(b).total_cmp(&cost(a)));
    order
}

/// Returns the number of lost flights among these costs.
fn lost(costs: &[f64]) -> usize {
    costs.iter().filter(|cost| **cost >= LOST).count()
}

/// The flights and conditions for each contender.
struct Trial<'a> {
    flights: &'a [Scenario],
    conditions: &'a [Condition],
    /// Indices of the flights in the order in which they are flown.
    order: Vec<usize>,
    /// Number of losses up to which a contender is not given up.
    bearable: usize,
}

/// A contender with its costs.
struct RatedContender {
    cost: f64,
    costs: Vec<f64>,
    given_up: bool,
    contender: Contender,
    point: Vec<f64>,
}

impl Trial<'_> {
    /// Returns the cost of `contender`, the cost of each flight, and true if the contender was given up.
    fn rate(&self, contender: &Contender) -> Result<(f64, Vec<f64>, bool), OutOfRange> {
        let mut costs = vec![2.0 * LOST; self.flights.len()];
        let mut losses = 0;
        for &index in &self.order {
            let (Some(scenario), Some(cost)) = (self.flights.get(index), costs.get_mut(index)) else { continue };
            // Flights run one after the other: contenders already run in parallel, and giving one up saves its
            // remaining flights.
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

/// Returns contenders with the gains of `points` and their costs, cheapest first.
fn rated(start: &Contender, trial: &Trial<'_>, points: Vec<Vec<f64>>) -> Vec<RatedContender> {
    let rated = |mut point: Vec<f64>| {
        let contender = gains::contender(start, &mut point);
        // Invalid combinations of gains cost more than any other.
        let (cost, costs, given_up) = trial.rate(&contender).unwrap_or((f64::MAX, Vec::new(), true));
        RatedContender { cost, costs, given_up, contender, point }
    };
    let mut rated: Vec<_> = points.into_par_iter().map(rated).collect();
    rated.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    rated
}

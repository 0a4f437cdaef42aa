//! What a contender is judged by.

use afbc_sim::contender::Contender;
use afbc_sim::metrics::Metrics;
use afbc_sim::run::Run;
use afbc_sim::scenario::Scenario;
use afbc_types::OutOfRange;
use rayon::prelude::*;

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

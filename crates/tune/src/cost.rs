//! The cost of a contender's flights.

use crate::fast;
use crate::scale::VehicleScale;
use afbc_scenario::Scenario;
use afbc_scenario::contender::Contender;
use afbc_sim::metrics::Metrics;
use afbc_sim::run::FlightResult;
use afbc_types::OutOfRange;
use rayon::prelude::*;

/// Root mean square distance from the reference that costs 1 \[m\], on the paper's vehicle.
pub const POSITION_M: f64 = 0.1;
/// Norm of the largest errors along x, y and z that costs 1 \[m\], on the paper's vehicle.
pub const WORST_M: f64 = 0.3;
/// Root mean square error of yaw that costs 1 \[rad\].
pub const YAW_RAD: f64 = 0.05;
/// Input roughness that costs 1: the mean |change per step|, summed over U1 to U4, on the paper's vehicle \[N\].
pub const JUMP_N: f64 = 0.5;
/// Cost of a loss, or of a trip of the monitor, at the end of the flight. At the start it costs twice as much.
pub const LOST: f64 = 1000.0;

/// Returns the cost of one flight. On a vehicle from a file, distances are divided by the length scale of its flights,
/// and inputs by its weight relative to the paper's vehicle.
pub fn cost(scenario: &Scenario, run: &FlightResult) -> f64 {
    let tripped_s = run.tripped.map(|tripped| tripped.time_s);
    if let Some(end_s) = run.lost.map(|lost| lost.time_s).or(tripped_s) {
        return LOST * (2.0 - end_s / scenario.duration_s);
    }
    let Metrics { rmse, max_abs, mean_abs_delta_u: jumps, .. } = &run.metrics;
    let VehicleScale { length, weight, .. } = VehicleScale::of(scenario.vehicle_file.as_ref());
    let errors = rmse.xyz().norm() / (POSITION_M * length) + rmse.w / YAW_RAD;
    // 0.03 stands for unnoticeable errors. Without it, the geometric mean would reward the last micrometre of an easy
    // flight.
    0.03 + errors + max_abs.xyz().norm() / (WORST_M * length) + jumps.sum() / (JUMP_N * weight)
}

/// Returns the cost of flying `scenario` under `contender`.
///
/// # Errors
/// The first parameter, gain or setting out of range.
pub(crate) fn flown(scenario: &Scenario, contender: &Contender) -> Result<f64, OutOfRange> {
    Ok(cost(scenario, &FlightResult::fly(scenario, &fast::free(scenario, contender), u64::MAX)?))
}

/// Returns the cost of each of `scenarios` under `contender`, whose tilt limit is 1.2 rad in fast flights.
///
/// # Errors
/// The first parameter, gain or setting out of range.
pub fn costs(scenarios: &[Scenario], contender: &Contender) -> Result<Vec<f64>, OutOfRange> {
    scenarios.par_iter().map(|scenario| flown(scenario, contender)).collect()
}

/// Returns the geometric mean of the flights' costs, which is the cost of a contender. Halving the cost of any one
/// flight has the same effect, however large its cost is.
pub fn mean(costs: &[f64]) -> f64 {
    libm::exp(costs.iter().copied().map(libm::log).sum::<f64>() / costs.len() as f64)
}

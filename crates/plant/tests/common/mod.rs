//! Input of the instruments, and statistics.

use afbc_plant::instruments::InstrumentFault;
use afbc_plant::{
    Environment, InstrumentReadings, InstrumentSuite, Motion, Plant, PlantModel, SimulatedInstruments, Truth,
};
use afbc_types::Parameters;
use nalgebra::{Quaternion, Vector3};

pub(crate) const STEP_S: f64 = 1e-3;

/// Returns a level hover at rest at the origin.
pub(crate) fn rest() -> Truth {
    let environment = Environment::calm(Parameters::PAPER).unwrap();
    Plant::new(PlantModel::RigidBody, Motion::default(), environment).truth()
}

/// Returns the same motion at step `k`.
pub(crate) fn at(truth: Truth, k: u32) -> Truth {
    Truth { time_s: f64::from(k) * STEP_S, ..truth }
}

pub(crate) fn instruments(suite: InstrumentSuite, seed: u64) -> SimulatedInstruments {
    SimulatedInstruments::new(&suite, &[], seed, STEP_S).unwrap()
}

/// Returns the readings of `steps` steps of a motion.
pub(crate) fn run(
    suite: InstrumentSuite,
    seed: u64,
    steps: u32,
    truth: impl Fn(u32) -> Truth,
) -> Vec<InstrumentReadings> {
    run_with(suite, &[], seed, steps, truth)
}

pub(crate) fn run_with(
    suite: InstrumentSuite,
    faults: &[InstrumentFault],
    seed: u64,
    steps: u32,
    truth: impl Fn(u32) -> Truth,
) -> Vec<InstrumentReadings> {
    let mut instruments = SimulatedInstruments::new(&suite, faults, seed, STEP_S).unwrap();
    (0..steps).map(|k| instruments.measure(&at(truth(k), k))).collect()
}

pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Returns the mean of the squares.
pub(crate) fn power(values: &[f64]) -> f64 {
    values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64
}

/// Checks that independent normal numbers of mean 0 have the standard deviation `sigma`, within five standard errors.
pub(crate) fn assert_sigma(values: &[f64], sigma: f64, what: &str) {
    assert_sigma_of(values, sigma, values.len() as f64, what);
}

/// Checks the standard deviation of correlated numbers that are worth `n` independent ones.
pub(crate) fn assert_sigma_of(values: &[f64], sigma: f64, n: f64, what: &str) {
    let ratio = power(values) / (sigma * sigma);
    let bound = 5.0 * (2.0 / n).sqrt();
    assert!((ratio - 1.0).abs() < bound, "{what}: {ratio} times the variance, bound {bound}");
}

/// Checks that pairs of normal numbers with the standard deviation `sigma` have this correlation, within five standard
/// errors.
pub(crate) fn assert_correlation(pairs: &[(f64, f64)], sigma: f64, correlation: f64, what: &str) {
    let n = pairs.len() as f64;
    let found = pairs.iter().map(|(a, b)| a * b).sum::<f64>() / n / (sigma * sigma);
    let bound = 5.0 * ((1.0 + correlation * correlation) / n).sqrt();
    assert!((found - correlation).abs() < bound, "{what}: correlation {found}, not {correlation} within {bound}");
}

pub(crate) fn coordinates(vectors: impl IntoIterator<Item = Vector3<f64>>) -> Vec<f64> {
    vectors.into_iter().flat_map(|v| [v.x, v.y, v.z]).collect()
}

/// Returns the rotation vector of `q`, near the identity.
pub(crate) fn rotation(q: Quaternion<f64>) -> Vector3<f64> {
    q.imag() * (2.0 * q.w.signum())
}

//! Checks of every estimate, and flights with changed samples or measurements.

use super::{Flight, ICM, Path, Sensors, double, fly, rest, settings};
use afbc_estimator::{Estimate, ImuSample, Measurement, Memory, Stamped};
use nalgebra::SMatrix;

/// Panics unless the whole estimate is finite and the covariance symmetric and positive.
pub fn sound(estimate: &Estimate, memory: &Memory) {
    let s = &estimate.sigmas;
    let state = &estimate.state;
    let vectors = [
        state.position_m,
        state.velocity_m_s,
        state.attitude_rad,
        state.rates_rad_s,
        estimate.gyro_bias_rad_s,
        estimate.accel_bias_m_s2,
        s.attitude_rad,
        s.velocity_m_s,
        s.position_m,
        s.gyro_bias_rad_s,
        s.accel_bias_m_s2,
    ];
    assert!(vectors.iter().all(|v| v.iter().all(|x| x.is_finite())), "{estimate:?}");
    assert!(estimate.height_offset_m.is_finite() && s.height_offset_m.is_finite());
    assert!(state.is_plausible(), "{state:?}");
    let norm: f32 = estimate.attitude.iter().map(|x| x * x).sum();
    assert!((norm - 1.0).abs() < 1e-3, "{norm}");
    assert!(memory.covariance().iter().flatten().all(|x| x.is_finite()));
}

/// Panics unless the covariance is symmetric and positive, up to rounding of 1e-5 in the correlation matrix.
pub fn positive(memory: &Memory) {
    let rows = memory.covariance();
    let p = SMatrix::<f64, 16, 16>::from_fn(|i, j| f64::from(rows[i][j]));
    assert!(p.iter().all(|x| x.is_finite()) && p == p.transpose(), "{p}");
    assert!(p.diagonal().iter().all(|x| *x > 0.0 && *x < 2e8), "{p}");
    let sigma = p.diagonal().map(f64::sqrt);
    let correlation = SMatrix::<f64, 16, 16>::from_fn(|i, j| p[(i, j)] / (sigma[i] * sigma[j]));
    let least = correlation.symmetric_eigenvalues().min();
    assert!(least > -1e-5, "{least}");
}

/// Runs at rest with changed samples; returns the last estimate and the memory.
pub fn at_rest(ms: usize, sensors: Sensors, change: impl Fn(usize, &mut ImuSample)) -> (Estimate, Memory) {
    let truth = fly(rest, ms as f64 * 1e-3);
    let mut flight = Flight::new(&truth, ICM, sensors, 3);
    let mut last = Estimate::default();
    for ms in 0..ms {
        last = flight.step_with(
            |sample| {
                change(ms, sample);
                true
            },
            |_| true,
        );
    }
    (last, flight.memory)
}

/// Flies a path with changed samples and measurements; calls `check` with each estimate.
pub fn flown(
    path: Path,
    sensors: Sensors,
    seconds: usize,
    imu: impl Fn(usize, &mut ImuSample) -> bool,
    deliver: impl Fn(usize, &mut Stamped<Measurement>) -> bool,
    mut check: impl FnMut(usize, &Estimate, &Flight<'_>),
) {
    let truth = fly(path, seconds as f64);
    let mut flight = Flight::with(&truth, ICM, sensors, 9, settings(&ICM));
    for ms in 0..seconds * 1000 {
        let estimate = flight.step_with(|sample| imu(ms, sample), |measurement| deliver(ms, measurement));
        sound(&estimate, &flight.memory);
        if ms % 20 == 0 && flight.memory.runs() {
            positive(&flight.memory);
        }
        check(ms, &estimate, &flight);
    }
}

pub fn position_error(estimate: &Estimate, flight: &Flight<'_>) -> f64 {
    (double(&estimate.state.position_m) - flight.moment().p).norm()
}

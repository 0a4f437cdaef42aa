//! Makes the estimator's measurements from simulated readings. Standard deviations come from the receiver or from the
//! data sheet that the vehicle is told. Errors drawn for this flight, such as a receiver's slow errors and hard iron,
//! are not included.

use afbc_estimator::{Measurement, Stamped};
use afbc_plant::instruments::{
    BarometerModel, BarometerReading, GnssFix, MagnetometerModel, MagnetometerReading, TrackerFix, TrackerModel,
};

/// Assumed speed that turns a tracker's timestamp noise into a position error \[m/s\].
const STAMPED_M_S: f64 = 1.0;
/// Smallest stated standard deviation, in each measurement's unit.
const SIGMA_MIN: f64 = 1e-4;

/// Returns the root of the sum of squares.
fn root(parts: &[f64]) -> f64 {
    libm::sqrt(parts.iter().map(|part| part * part).sum())
}

/// Returns the standard deviation of quantisation.
fn step(lsb: f64) -> f64 {
    // The error is uniform over one step.
    lsb / libm::sqrt(12.0)
}

/// Stamps a value with `time_s`, converted to the vehicle's clock by `at_us`.
fn timed(value: Measurement, time_s: f64, at_us: impl Fn(f64) -> u64) -> Stamped<Measurement> {
    Stamped { value, at_us: at_us(time_s) }
}

fn sigma(parts: &[f64]) -> f32 {
    root(parts).max(SIGMA_MIN) as f32
}

/// Returns a tracker's pose as a measurement.
pub(super) fn pose(fix: &TrackerFix, tracker: &TrackerModel, at_us: impl Fn(f64) -> u64) -> Stamped<Measurement> {
    let q = fix.attitude.coords;
    let value = Measurement::Pose {
        position_m: fix.position_m.cast(),
        attitude: [q.w, q.x, q.y, q.z].map(|part| part as f32),
        position_sigma_m: sigma(&[tracker.position_m, tracker.stamp_noise_s * STAMPED_M_S]),
        attitude_sigma_rad: sigma(&[tracker.attitude_rad]).max(1e-3),
    };
    timed(value, fix.true_at_s, at_us)
}

/// Returns a GNSS fix as a measurement, with the receiver's stated accuracy.
pub(super) fn gnss(fix: &GnssFix, at_us: impl Fn(f64) -> u64) -> Stamped<Measurement> {
    let speed_sigma_m_s = sigma(&[fix.velocity_sigma_m_s]).max(1e-3);
    let value = Measurement::Gnss {
        position_m: fix.position_m.cast(),
        velocity_m_s: fix.velocity_m_s.cast(),
        horizontal_sigma_m: sigma(&[fix.horizontal_sigma_m]),
        vertical_sigma_m: sigma(&[fix.vertical_sigma_m]),
        speed_sigma_m_s,
        climb_sigma_m_s: speed_sigma_m_s,
    };
    timed(value, fix.true_at_s, at_us)
}

/// Returns a barometer's height as a measurement.
pub(super) fn height(
    fix: &BarometerReading,
    barometer: &BarometerModel,
    at_us: impl Fn(f64) -> u64,
) -> Stamped<Measurement> {
    let sigma_m = sigma(&[barometer.noise_m, step(barometer.lsb_m)]);
    timed(Measurement::Height { height_m: fix.height_m as f32, sigma_m }, fix.true_at_s, at_us)
}

/// Returns a magnetic field as a measurement with its noise. The estimator's settings cover hard iron, soft iron and
/// the motors' fields.
pub(super) fn field(
    fix: &MagnetometerReading,
    part: &MagnetometerModel,
    at_us: impl Fn(f64) -> u64,
) -> Stamped<Measurement> {
    let sigma = sigma(&[part.noise_ut, step(part.lsb_ut)]);
    timed(Measurement::MagneticField { field: fix.field_ut.cast(), sigma }, fix.true_at_s, at_us)
}

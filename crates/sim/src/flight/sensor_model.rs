//! Measurements as an estimator gets them, with the standard deviations that receivers state and data sheets that it is
//! told of, not what was drawn for this flight: slow errors of a receiver, hard iron.

use afbc_estimator::{Measurement, Stamped};
use afbc_plant::instruments::{Barometer, FieldFix, GnssFix, HeightFix, Magnetometer, TrackerFix, TrackerModel};

/// Speed at which the noise of a tracker's stamps counts \[m/s\].
const STAMPED_M_S: f64 = 1.0;
/// Smallest standard deviation that is stated, in the unit of each.
const SIGMA_MIN: f64 = 1e-4;

/// Root of the sum of squares.
fn root(parts: &[f64]) -> f64 {
    libm::sqrt(parts.iter().map(|part| part * part).sum())
}

/// Error of quantisation.
fn step(lsb: f64) -> f64 {
    // Standard deviation of an error that is uniform over one step.
    lsb / libm::sqrt(12.0)
}

/// Stamps a value of `time_s` on the clock that `at_us` converts to.
fn timed(value: Measurement, time_s: f64, at_us: impl Fn(f64) -> u64) -> Stamped<Measurement> {
    Stamped { value, at_us: at_us(time_s) }
}

fn sigma(parts: &[f64]) -> f32 {
    root(parts).max(SIGMA_MIN) as f32
}

/// A pose.
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

/// A fix, as good as the receiver says.
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

/// A height.
pub(super) fn height(fix: &HeightFix, barometer: &Barometer, at_us: impl Fn(f64) -> u64) -> Stamped<Measurement> {
    let sigma_m = sigma(&[barometer.noise_m, step(barometer.lsb_m)]);
    timed(Measurement::Height { height_m: fix.height_m as f32, sigma_m }, fix.true_at_s, at_us)
}

/// A field with its noise; what hard and soft iron and the motors add is in the settings.
pub(super) fn field(fix: &FieldFix, part: &Magnetometer, at_us: impl Fn(f64) -> u64) -> Stamped<Measurement> {
    let sigma = sigma(&[part.noise_ut, step(part.lsb_ut)]);
    timed(Measurement::MagneticField { field: fix.field_ut.cast(), sigma }, fix.true_at_s, at_us)
}

//! Makes measurements for the estimator from the aiding sensors in a log, with assumed measurement errors.

use crate::recording::{AidingSample, SampleSource, Sensor, flip};
use afbc_estimator::{GeodeticOrigin, Measurement, Stamped};
use nalgebra::Vector3;

/// Limits on the standard deviations of a receiver's position, height \[m\] and velocity \[m/s\]: smallest and largest.
/// A receiver states only its remaining noise, not the errors that stay constant for minutes. The values are EKF2's.
const HORIZONTAL_M: (f64, f64) = (0.5, 100.0);
const VERTICAL_M: (f64, f64) = (1.0, 100.0);
const SPEED_M_S: (f64, f64) = (0.3, 10.0);
/// Standard deviation of the velocity of a fix without a velocity \[m/s\].
const UNTOLD_M_S: f32 = 1e3;
/// Noise of a barometer in flight \[m\] and of a magnetometer \[gauss\].
const BAROMETER_M: f32 = 0.5;
const FIELD_GAUSS: f32 = 0.05;
/// Shortest time between two heights or two fields \[us\]: samples in between bring nothing new.
const SPARSE_US: u64 = 15_000;
/// Largest distance of a fix from the median fix \[degrees\]: the estimator covers 50 km.
const FAR_DEG: f64 = 0.4;

/// A fix of a GNSS receiver.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReceiverFix {
    pub(crate) arrived_us: u64,
    /// Latitude and longitude \[degrees\], altitude \[m\].
    pub(crate) place: [f64; 3],
    /// Velocity north, east, down \[m/s\], if known.
    pub(crate) velocity_m_s: Option<[f64; 3]>,
    /// Standard deviations that the receiver states; values that it does not state are raised to the lower limit.
    pub(crate) horizontal_m: f64,
    pub(crate) vertical_m: f64,
    pub(crate) speed_m_s: f64,
}

impl ReceiverFix {
    /// Returns true if the coordinates are valid and are not those of a receiver without a fix.
    pub(crate) fn is_place(&self) -> bool {
        let [latitude, longitude, altitude] = self.place;
        // A receiver without a fix reports latitude and longitude zero.
        GeodeticOrigin::new(latitude, longitude, altitude).is_some() && (latitude, longitude) != (0.0, 0.0)
    }
}

/// Returns the first fix that is close to the median of all fixes.
pub(crate) fn begin(fixes: &[ReceiverFix]) -> Option<&ReceiverFix> {
    let middle = |of: fn(&ReceiverFix) -> f64| {
        let mut all: Vec<f64> = fixes.iter().map(of).collect();
        // The median is used because a single absurd fix does not move it.
        all.sort_by(f64::total_cmp);
        all.get(all.len() / 2).copied()
    };
    let (latitude, longitude) = (middle(|fix| fix.place[0])?, middle(|fix| fix.place[1])?);
    let near =
        |fix: &&ReceiverFix| (fix.place[0] - latitude).abs() < FAR_DEG && (fix.place[1] - longitude).abs() < FAR_DEG;
    fixes.iter().find(near)
}

/// Returns the fixes as measurements; `delay_us` is the receiver's delay.
pub(crate) fn gnss(fixes: &[ReceiverFix], origin: &GeodeticOrigin, delay_us: u64) -> Vec<AidingSample> {
    let sigma = |stated: f64, (least, most): (f64, f64)| stated.max(least).min(most) as f32;
    let aiding = |fix: &ReceiverFix| {
        let [latitude, longitude, altitude] = fix.place;
        let speed_sigma_m_s = fix.velocity_m_s.map_or(UNTOLD_M_S, |_| sigma(fix.speed_m_s, SPEED_M_S));
        let value = Measurement::Gnss {
            position_m: origin.local(latitude, longitude, altitude),
            velocity_m_s: fix.velocity_m_s.map_or(Vector3::zeros(), flip),
            horizontal_sigma_m: sigma(fix.horizontal_m, HORIZONTAL_M),
            vertical_sigma_m: sigma(fix.vertical_m, VERTICAL_M),
            speed_sigma_m_s,
            climb_sigma_m_s: speed_sigma_m_s,
        };
        aided(value, fix.arrived_us, fix.arrived_us, delay_us)
    };
    fixes.iter().map(aiding).collect()
}

/// Returns a barometer's height as a measurement.
pub(crate) fn height(arrived_us: u64, at_us: u64, height_m: f64, delay_us: u64) -> AidingSample {
    let value = Measurement::Height { height_m: height_m as f32, sigma_m: BAROMETER_M };
    aided(value, arrived_us, at_us, delay_us)
}

/// Returns a magnetic field as a measurement.
pub(crate) fn field(arrived_us: u64, at_us: u64, gauss: [f64; 3], delay_us: u64) -> AidingSample {
    let value = Measurement::MagneticField { field: flip(gauss), sigma: FIELD_GAUSS };
    aided(value, arrived_us, at_us, delay_us)
}

fn aided(value: Measurement, arrived_us: u64, at_us: u64, delay_us: u64) -> AidingSample {
    AidingSample { arrived_us, measurement: Stamped { value, at_us: at_us.saturating_sub(delay_us) } }
}

/// Appends the plausible measurements to `all`, in the order of time, and returns their source. Heights and fields are
/// thinned out to [`SPARSE_US`]. `raw` is the number of samples in the log.
pub(crate) fn collect(
    all: &mut Vec<AidingSample>,
    sensor: Sensor,
    topic: &str,
    raw: usize,
    aiding: Vec<AidingSample>,
) -> SampleSource {
    let usable: Vec<_> = aiding.into_iter().filter(|aiding| aiding.measurement.value.is_plausible()).collect();
    let (mut kept, _) = crate::order::rising(usable, |aiding| aiding.measurement.at_us);
    if sensor != Sensor::Gnss {
        kept = sparse(kept, SPARSE_US, |aiding| aiding.measurement.at_us);
    }
    let used = kept.len();
    all.append(&mut kept);
    SampleSource { sensor, topic: topic.into(), used, skipped: raw.saturating_sub(used) }
}

/// Keeps samples that are at least `apart_us` apart.
pub(crate) fn sparse<T>(samples: Vec<T>, apart_us: u64, at_us: impl Fn(&T) -> u64) -> Vec<T> {
    let mut last_us: Option<u64> = None;
    let keep = |sample: &T| {
        // The sum saturates, since a damaged log may contain any time.
        let keep = last_us.is_none_or(|last_us| at_us(sample) >= last_us.saturating_add(apart_us));
        if keep {
            last_us = Some(at_us(sample));
        }
        keep
    };
    samples.into_iter().filter(keep).collect()
}

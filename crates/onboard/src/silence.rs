//! Sensors that have fallen silent.

use crate::readings::Readings;
use afbc_estimator::Measurement;
use afbc_guidance::Sensors;

/// Silence after which an inertial sensor, and any other one, counts as failed \[us\].
const INERTIAL_US: u64 = 100_000;
const OTHER_US: u64 = 1_000_000;

/// Time of the last reading of each sensor; none before the first \[us\].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Silence {
    inertial: Option<u64>,
    barometer: Option<u64>,
    magnetometer: Option<u64>,
    gnss: Option<u64>,
    tracker: Option<u64>,
}

impl Silence {
    /// Notes what was read for the tick at `now_us`, and whether a pose came over the link; returns the sensors that
    /// have read something before and are silent now.
    #[inline]
    pub(crate) fn tick(&mut self, now_us: u64, readings: &Readings, pose: bool) -> Sensors {
        if readings.imu.is_some() {
            self.inertial = Some(now_us);
        }
        if pose {
            self.tracker = Some(now_us);
        }
        for aid in readings.aids.iter().flatten() {
            let heard = match aid.value {
                Measurement::Pose { .. } | Measurement::Position { .. } | Measurement::Heading { .. } => {
                    &mut self.tracker
                }
                Measurement::Gnss { .. } => &mut self.gnss,
                Measurement::Height { .. } => &mut self.barometer,
                Measurement::MagneticField { .. } => &mut self.magnetometer,
            };
            *heard = Some(now_us);
        }
        let is_silent = |heard_us: Option<u64>, most_us: u64| {
            heard_us.is_some_and(|heard_us| now_us.saturating_sub(heard_us) > most_us)
        };
        Sensors {
            inertial: is_silent(self.inertial, INERTIAL_US),
            barometer: is_silent(self.barometer, OTHER_US),
            magnetometer: is_silent(self.magnetometer, OTHER_US),
            gnss: is_silent(self.gnss, OTHER_US),
            tracker: is_silent(self.tracker, OTHER_US),
        }
    }
}

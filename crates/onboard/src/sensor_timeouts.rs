//! Detects sensors that have fallen silent.

use crate::readings::Readings;
use afbc_estimator::Measurement;
use afbc_guidance::FailedSensors;

/// Silence after which a sensor counts as failed: the inertial sensor, and any other one \[us\].
const INERTIAL_US: u64 = 100_000;
const OTHER_US: u64 = 1_000_000;

/// Time of each sensor's last reading; none before the first \[us\].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SensorTimeouts {
    inertial: Option<u64>,
    barometer: Option<u64>,
    magnetometer: Option<u64>,
    gnss: Option<u64>,
    tracker: Option<u64>,
}

impl SensorTimeouts {
    /// Takes the readings of the tick at `now_us`, and whether a pose came over the link. Returns the sensors that have
    /// read something before and are silent now.
    #[inline]
    pub(crate) fn tick(&mut self, now_us: u64, readings: &Readings, pose: bool) -> FailedSensors {
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
        FailedSensors {
            inertial: is_silent(self.inertial, INERTIAL_US),
            barometer: is_silent(self.barometer, OTHER_US),
            magnetometer: is_silent(self.magnetometer, OTHER_US),
            gnss: is_silent(self.gnss, OTHER_US),
            tracker: is_silent(self.tracker, OTHER_US),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::readings::Aged;
    use nalgebra::Vector3;

    const NOTHING: Readings = Readings::NONE;

    fn of(value: Measurement) -> Readings {
        Readings { aids: [None, Some(Aged { value, age_us: 0 })], ..NOTHING }
    }

    /// Each sensor is silent independently: after its first reading and its own time-out, until its next reading.
    #[test]
    fn each_sensor_is_silent_after_its_time() {
        type Which = fn(&FailedSensors) -> bool;
        let zero = Vector3::zeros();
        let imu = Readings { imu: Some(Aged { value: [zero; 2], age_us: 0 }), ..NOTHING };
        let gnss = Measurement::Gnss {
            position_m: zero,
            velocity_m_s: zero,
            horizontal_sigma_m: 1.0,
            vertical_sigma_m: 1.0,
            speed_sigma_m_s: 1.0,
            climb_sigma_m_s: 1.0,
        };
        let pose = Measurement::Pose {
            position_m: zero,
            attitude: [1.0, 0.0, 0.0, 0.0],
            position_sigma_m: 1.0,
            attitude_sigma_rad: 1.0,
        };
        let cases: [(Readings, bool, u64, Which); 8] = [
            (imu, false, 100_000, |sensors| sensors.inertial),
            (of(gnss), false, 1_000_000, |sensors| sensors.gnss),
            (of(Measurement::Height { height_m: 0.0, sigma_m: 1.0 }), false, 1_000_000, |sensors| sensors.barometer),
            (of(Measurement::MagneticField { field: zero, sigma: 1.0 }), false, 1_000_000, |sensors| {
                sensors.magnetometer
            }),
            (of(pose), false, 1_000_000, |sensors| sensors.tracker),
            (of(Measurement::Position { position_m: zero, sigma_m: 1.0 }), false, 1_000_000, |sensors| sensors.tracker),
            (of(Measurement::Heading { heading_rad: 0.0, sigma_rad: 1.0 }), false, 1_000_000, |sensors| {
                sensors.tracker
            }),
            (NOTHING, true, 1_000_000, |sensors| sensors.tracker),
        ];
        for (readings, pose, most_us, which) in cases {
            let mut silence = SensorTimeouts::default();
            assert!(!silence.tick(5_000_000, &NOTHING, false).any(), "it was never heard");
            assert!(!silence.tick(6_000_000, &readings, pose).any());
            assert!(!silence.tick(6_000_000 + most_us, &NOTHING, false).any());
            let sensors = silence.tick(6_000_001 + most_us, &NOTHING, false);
            assert!(which(&sensors) && sensors.any());
            let flags = [sensors.inertial, sensors.barometer, sensors.magnetometer, sensors.gnss, sensors.tracker];
            assert_eq!(flags.into_iter().filter(|flag| *flag).count(), 1);
            assert!(!silence.tick(6_000_002 + most_us, &readings, pose).any());
        }
    }
}

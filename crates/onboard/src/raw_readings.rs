//! Averages uncorrected readings for a calibration.

use crate::readings::Readings;
use afbc_calibration::RawSample;
use afbc_estimator::Measurement;
use nalgebra::Vector3;

/// Number of inertial samples in a [`RawSample`]: 20 ms.
const READINGS: u16 = 20;

/// Sums of the sensors' readings, extended in each tick while the vehicle is calibrated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RawReadings {
    newest_us: u64,
    readings: u16,
    rates_rad_s: Vector3<f32>,
    specific_force_m_s2: Vector3<f32>,
    fields: u16,
    field_ut: Vector3<f32>,
}

impl RawReadings {
    /// No readings.
    pub const NONE: Self = {
        let zero = Vector3::new(0.0, 0.0, 0.0);
        RawReadings {
            newest_us: 0,
            readings: 0,
            rates_rad_s: zero,
            specific_force_m_s2: zero,
            fields: 0,
            field_ut: zero,
        }
    };

    /// Adds the readings of a tick at `now_us`.
    #[inline(never)]
    pub fn add(&mut self, now_us: u64, readings: &Readings) {
        if let Some(imu) = readings.sample(now_us) {
            self.newest_us = imu.at_us;
            self.readings = self.readings.saturating_add(1);
            self.rates_rad_s += imu.rates_rad_s;
            self.specific_force_m_s2 += imu.specific_force_m_s2;
        }
        for aid in readings.aids.iter().flatten() {
            if let Measurement::MagneticField { field, .. } = aid.value {
                self.fields = self.fields.saturating_add(1);
                self.field_ut += field;
            }
        }
    }

    /// Returns the means and starts again, or returns none as long as there are too few readings.
    pub fn take(&mut self) -> Option<RawSample> {
        if self.readings < READINGS {
            return None;
        }
        let RawReadings { newest_us, readings, rates_rad_s, specific_force_m_s2, fields, field_ut } =
            core::mem::replace(self, RawReadings::NONE);
        let count = f32::from(readings);
        Some(RawSample {
            at_us: newest_us,
            rates_rad_s: rates_rad_s / count,
            specific_force_m_s2: specific_force_m_s2 / count,
            field_ut: (fields > 0).then(|| field_ut / f32::from(fields)),
        })
    }
}

#[cfg(test)]
#[allow(clippy::expect_used, reason = "a test that cannot go on should say why")]
mod tests {
    use super::*;
    use crate::readings::Aged;

    /// A sample has the means of twenty readings and the newest time. The next one starts from zero.
    #[test]
    fn readings_are_averaged() {
        let mut raw = RawReadings::NONE;
        for round in 0..3_u16 {
            for number in 1..=READINGS {
                assert_eq!(raw.take(), None);
                let value = f32::from(number + 100 * round);
                let imu = Some(Aged { value: [Vector3::repeat(value), Vector3::repeat(-value)], age_us: 100 });
                let field = Measurement::MagneticField { field: Vector3::repeat(value), sigma: 1.0 };
                let aid = (number % 10 == 0 && round != 2).then_some(Aged { value: field, age_us: 0 });
                raw.add(1000 * u64::from(number), &Readings { imu, aids: [aid, None] });
            }
            let sample = raw.take().expect("enough");
            let mean = 10.5 + 100.0 * f32::from(round);
            assert_eq!(sample.at_us, 19_900);
            assert_eq!((sample.rates_rad_s.x, sample.specific_force_m_s2.z), (mean, -mean));
            // The field is the mean of the tenth and the twentieth reading.
            let field = (round != 2).then(|| Vector3::repeat(mean + 4.5));
            assert_eq!(sample.field_ut, field);
        }
    }
}

//! Estimator settings from the data sheets of the sensors.
//!
//! Software knows a part's data sheet, but not the bias, scale, hard iron or slow GNSS error of one specimen. Noise
//! densities in data sheets are one-sided: a random walk grows with half their square. Vibration is bounded, but a
//! filter that is corrected every few periods sees it as a random walk of a share of its amplitude.

use crate::settings::Settings;
use libm::sqrt;

/// Rate and acceleration at which scale and alignment errors count, each lasting a second.
const TURNING_RAD_S: f64 = 0.2;
const SPEEDING_M_S2: f64 = 1.0;
/// Share of the vibration that counts as white noise, fitted to the errors of a hundred flights.
const SHAKEN: f64 = 0.6;
/// Time for which a tilt error by the gyroscope's misalignment keeps its value \[s\], fitted to hours of flight.
const LEANING_S: f64 = 100.0;

/// Figures of a gyroscope in rad/s or of an accelerometer in m/s2. Each is a standard deviation unless stated
/// otherwise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct InertialSensorFigures {
    /// One-sided density of the white noise \[unit/rtHz\].
    pub noise_rthz: f64,
    /// Random walk of the bias after one second \[unit\].
    pub walk: f64,
    /// Bias instability, a first-order Gauss-Markov process \[unit\].
    pub instability: f64,
    /// Correlation time of the bias instability \[s\].
    pub instability_time_s: f64,
    /// Constant bias \[unit\].
    pub bias: f64,
    /// Error of each axis's scale factor.
    pub scale: f64,
    /// Angles of each axis to the other two \[rad\].
    pub misalignment_rad: f64,
    /// Largest measurable value, 0 for no limit \[unit\].
    pub range: f64,
    /// Step of the output, 0 for none \[unit\].
    pub lsb: f64,
    /// Vibration of the vehicle in hover, root mean square \[unit\].
    pub vibration: f64,
}

/// Data sheet figures of a vehicle's sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DataSheet {
    /// Figures of the gyroscope.
    pub gyro: InertialSensorFigures,
    /// Figures of the accelerometer.
    pub accel: InertialSensorFigures,
    /// Sample period of gyroscope and accelerometer \[s\].
    pub step_s: f64,
    /// Acceleration of free fall \[m/s2\].
    pub gravity_m_s2: f64,
    /// Drift \[m\] of the barometer, a first-order Gauss-Markov process, and its correlation time \[s\].
    pub barometer: Option<(f64, f64)>,
    /// Noise of the GNSS receiver from fix to fix \[m\], and the correlation time of its slow error \[s\].
    pub gnss: Option<(f64, f64)>,
    /// Heading error of the magnetometer by hard and soft iron and the motors' field, and the declination \[rad\].
    pub magnetometer: Option<(f64, f64)>,
    /// True if the readings of tracker and magnetometer (those present) change from one to the next even at rest. Then
    /// a reading that repeats means a frozen sensor.
    pub differs: bool,
}

/// Returns the root of the sum of squares.
fn root(parts: &[f64]) -> f64 {
    sqrt(parts.iter().map(|part| part * part).sum())
}

/// Returns the random walk per root of a second that a Gauss-Markov process makes.
fn markov(sigma: f64, time_s: f64) -> f64 {
    // The driving noise has the density 2 sigma^2/time.
    sigma * sqrt(2.0 / time_s)
}

impl InertialSensorFigures {
    /// Returns the two-sided density of everything that counts as white noise, at the rate or acceleration `moving`
    /// \[unit/rtHz\].
    fn density(&self, step_s: f64, moving: f64) -> f64 {
        // Noise of sigma in each sample has the density sigma sqrt(step). The quantisation error is uniform over one
        // step of the output.
        let per_root_s = sqrt(step_s);
        let quantisation = self.lsb / sqrt(12.0);
        let [quantisation, vibration] = [quantisation, SHAKEN * self.vibration].map(|sigma| sigma * per_root_s);
        let geometry = root(&[self.scale, self.misalignment_rad]) * moving;
        root(&[self.noise_rthz / sqrt(2.0), quantisation, vibration, geometry])
    }

    /// Returns true if two samples at rest differ.
    fn is_noisy(&self, step_s: f64) -> bool {
        self.noise_rthz > 0.0 && self.noise_rthz / sqrt(step_s) > self.lsb
    }
}

impl Settings {
    /// Returns the settings for these parts; the other settings keep their defaults.
    #[must_use]
    pub fn for_parts(parts: &DataSheet) -> Self {
        let DataSheet { gyro, accel, step_s, gravity_m_s2, barometer, gnss, magnetometer, differs } = parts;
        let gyro_walk = root(&[gyro.walk, markov(gyro.instability, gyro.instability_time_s)]);
        // Misaligned gyroscope axes convert a turn about the vertical into a tilt. The tilt is the same on every turn,
        // so it cannot be distinguished from an accelerometer bias.
        let leaning = markov(gyro.misalignment_rad * gravity_m_s2, LEANING_S);
        let accel_walk = root(&[accel.walk, markov(accel.instability, accel.instability_time_s), leaning]);
        let accel_bias = root(&[accel.bias, accel.instability, accel.scale * gravity_m_s2]);
        let accel_bias = root(&[accel_bias, accel.misalignment_rad * gravity_m_s2]);
        let range = |range: f64, most: f64| if range > 0.0 { range.min(most) as f32 } else { most as f32 };
        let within = |value: f64, low: f64, high: f64| value.clamp(low, high) as f32;
        // Without noise, a sensor at rest repeats its sample, so the check for a stuck sensor is switched off.
        let moves = gyro.is_noisy(*step_s) || accel.is_noisy(*step_s);
        let default = Settings::DEFAULT;
        Settings {
            gravity_m_s2: *gravity_m_s2 as f32,
            gyro_noise_rad_s_rthz: within(gyro.density(*step_s, TURNING_RAD_S), 1e-5, 0.1),
            accel_noise_m_s2_rthz: within(accel.density(*step_s, SPEEDING_M_S2), 1e-4, 1.0),
            gyro_walk_rad_s_rts: within(gyro_walk, 1e-6, 0.01),
            accel_walk_m_s2_rts: within(accel_walk, 1e-5, 0.1),
            accel_bias_m_s2: within(accel_bias, 1e-3, 1.0),
            // The limit is five sigma, because alignment refuses any larger rate as a turn.
            gyro_bias_max_rad_s: within(5.0 * gyro.bias, 0.35, 1.0),
            baro_walk_m_rts: barometer
                .map_or(default.baro_walk_m_rts, |(drift_m, time_s)| within(markov(drift_m, time_s), 1e-4, 1.0)),
            gnss_noise_m: gnss.map_or(default.gnss_noise_m, |(noise_m, _)| within(noise_m, 0.01, 1000.0)),
            gnss_slow_s: gnss.map_or(default.gnss_slow_s, |(_, slow_s)| within(slow_s, 1.0, 1e5)),
            mag_slow_rad: magnetometer.map_or(default.mag_slow_rad, |(iron_rad, _)| within(iron_rad, 0.0, 1.0)),
            declination_rad: magnetometer.map_or(0.0, |(_, declination_rad)| within(declination_rad, -3.2, 3.2)),
            gyro_range_rad_s: range(gyro.range, 100.0),
            accel_range_m_s2: range(accel.range, 1000.0),
            stuck_s: if moves { default.stuck_s } else { 0.0 },
            frozen_s: if *differs { default.frozen_s } else { 0.0 },
            ..default
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{DataSheet, InertialSensorFigures};
    use crate::settings::Settings;
    use afbc_types::Declared;
    use proptest::prelude::*;

    fn triad() -> impl Strategy<Value = InertialSensorFigures> {
        (prop::array::uniform9(0.0..10.0_f64), 0.001..1e5_f64).prop_map(|(figures, instability_time_s)| {
            let [noise_rthz, walk, instability, bias, scale, misalignment_rad, range, lsb, vibration] = figures;
            let range = range * 1000.0;
            InertialSensorFigures {
                noise_rthz,
                walk,
                instability,
                instability_time_s,
                bias,
                scale,
                misalignment_rad,
                range,
                lsb,
                vibration,
            }
        })
    }

    fn part() -> impl Strategy<Value = Option<(f64, f64)>> {
        prop::option::of((0.0..1000.0, 0.001..1e5))
    }

    proptest! {
        /// Any data sheet gives valid settings, and worse parts never give smaller noise settings.
        #[test]
        fn every_data_sheet_makes_valid_settings(
            gyro in triad(), accel in triad(), barometer in part(), gnss in part(), magnetometer in part(),
            differs: bool, worse in 0_usize..8,
        ) {
            let sheet = DataSheet {
                gyro, accel, step_s: 0.001, gravity_m_s2: 9.8, barometer, gnss, magnetometer, differs,
            };
            let settings = Settings::for_parts(&sheet);
            prop_assert!(settings.validate().is_ok(), "{settings:?}");

            let mut poor = sheet;
            for triad in [&mut poor.gyro, &mut poor.accel] {
                let InertialSensorFigures { noise_rthz, walk, instability, bias, .. } = triad;
                let InertialSensorFigures { scale, misalignment_rad, lsb, vibration, .. } = triad;
                let figures = [noise_rthz, walk, instability, bias, scale, misalignment_rad, lsb, vibration];
                figures.into_iter().nth(worse).into_iter().for_each(|figure| *figure *= 2.0);
            }
            let noises = |s: &Settings| [s.gyro_noise_rad_s_rthz, s.accel_noise_m_s2_rthz, s.gyro_walk_rad_s_rts,
                s.accel_walk_m_s2_rts, s.accel_bias_m_s2, s.gyro_bias_max_rad_s];
            let poor = Settings::for_parts(&poor);
            for (better, worse) in noises(&settings).into_iter().zip(noises(&poor)) {
                prop_assert!(better <= worse);
            }
        }
    }
}

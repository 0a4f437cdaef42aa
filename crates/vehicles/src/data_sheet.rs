//! Estimator settings from the data sheets of a vehicle's simulated sensors.

use afbc_estimator::{DataSheet, InertialSensorFigures, Settings};
use afbc_plant::InstrumentSuite;
use afbc_plant::instruments::{ImuModel, MagnetometerModel};

/// Returns the estimator's settings for this inertial sensor and the other instruments of `suite`, on a vehicle with
/// this number of rotors, with samples every `step_s`.
#[must_use]
pub fn settings(suite: &InstrumentSuite, imu: &ImuModel, rotors: usize, gravity_m_s2: f64, step_s: f64) -> Settings {
    let ImuModel { gyro, accel, harmonics, .. } = imu;
    // Vibration of all rotors in hover, from the amplitude of one rotor's first harmonic.
    let vibration = |amplitude: f64| amplitude * libm::sqrt(0.5 * rotors as f64) * harmonics.norm();
    Settings::for_parts(&DataSheet {
        gyro: InertialSensorFigures {
            noise_rthz: gyro.noise_rad_s_rthz,
            walk: gyro.walk_rad_s2_rthz,
            instability: gyro.instability_rad_s,
            instability_time_s: gyro.instability_time_s,
            bias: gyro.bias_rad_s,
            scale: gyro.scale,
            misalignment_rad: gyro.misalignment_rad,
            range: gyro.range_rad_s,
            lsb: gyro.lsb_rad_s,
            vibration: vibration(gyro.vibration_rad_s),
        },
        accel: InertialSensorFigures {
            noise_rthz: accel.noise_m_s2_rthz,
            walk: accel.walk_m_s3_rthz,
            instability: accel.instability_m_s2,
            instability_time_s: accel.instability_time_s,
            bias: accel.bias_m_s2,
            scale: accel.scale,
            misalignment_rad: accel.misalignment_rad,
            range: accel.range_m_s2,
            lsb: accel.lsb_m_s2,
            vibration: vibration(accel.vibration_m_s2),
        },
        step_s,
        gravity_m_s2,
        barometer: suite.barometer.map(|part| (part.drift_m, part.drift_time_s)),
        gnss: suite.gnss.map(|part| (part.noise_m, part.correlation_time_s)),
        magnetometer: suite.magnetometer.map(|part| (iron(&part), part.declination_rad)),
        differs: suite.tracker.is_none_or(|it| it.position_m > 0.0 || it.attitude_rad > 0.0)
            && suite.magnetometer.is_none_or(|it| it.noise_ut > it.lsb_ut / 4.0),
    })
}

/// Returns the heading error from hard iron, soft iron and the motors' magnetic field \[rad\].
fn iron(part: &MagnetometerModel) -> f64 {
    let parts = [part.hard_iron_ut, part.soft_iron * part.strength_ut, part.motor_ut.xy().amax()];
    let field_ut = libm::sqrt(parts.iter().map(|part| part * part).sum());
    field_ut / (part.strength_ut * libm::cos(part.inclination_rad))
}

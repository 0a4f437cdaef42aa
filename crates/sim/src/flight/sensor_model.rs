//! What an estimator is told of its instruments: settings and measurements.
//!
//! A vehicle's software knows the data sheets of its parts and how they are mounted, not what was drawn for this
//! flight: bias, scale, hard iron, slow errors of a receiver.

use afbc_estimator::{ImuSample, Measurement, Settings, Stamped};
use afbc_plant::InstrumentSuite;
use afbc_plant::instruments::{
    Barometer, FieldFix, GnssFix, HeightFix, Imu, ImuReading, Magnetometer, Mounting, TrackerFix, TrackerModel,
};
use nalgebra::{Matrix3, Vector3};

/// Rate and acceleration at which errors of scale and alignment count, each for a second.
const TURNING_RAD_S: f64 = 0.2;
const SPEEDING_M_S2: f64 = 1.0;
/// Share of the vibration that counts as white noise: what the errors of a hundred flights ask for.
const SHAKEN: f64 = 0.6;
/// Time for which a tilt by the gyroscope's misalignment counts as the same \[s\]: what hours of flight ask for.
const LEANING_S: f64 = 100.0;
/// Speed at which the noise of a tracker's stamps counts \[m/s\].
const STAMPED_M_S: f64 = 1.0;
/// Smallest standard deviation that is told, in the unit of each.
const SIGMA_MIN: f64 = 1e-4;

/// Root of the sum of squares.
fn root(parts: &[f64]) -> f64 {
    libm::sqrt(parts.iter().map(|part| part * part).sum())
}

/// Error of quantisation.
fn step(lsb: f64) -> f64 {
    lsb / libm::sqrt(12.0)
}

/// Vibration of `rotors` in hover that counts, root mean square, if the first harmonic of one has this amplitude.
fn vibration(amplitude: f64, imu: &Imu, rotors: usize) -> f64 {
    SHAKEN * amplitude * libm::sqrt(0.5 * rotors as f64) * imu.harmonics.norm()
}

/// Error of the heading by hard and soft iron and the motors' field.
fn iron(part: &Magnetometer) -> f64 {
    let field = root(&[part.hard_iron_ut, part.soft_iron * part.strength_ut, part.motor_ut.xy().amax()]);
    field / (part.strength_ut * libm::cos(part.inclination_rad))
}

/// Returns the settings for these instruments on a vehicle of so many rotors, if their samples are `step_s` apart.
///
/// Densities of data sheets are one-sided: a random walk grows with half their square. Vibration is bounded, but
/// to a filter that is corrected every few of its periods it is like a random walk, of a share of it.
pub(super) fn settings(suite: &InstrumentSuite, imu: &Imu, rotors: usize, gravity_m_s2: f64, step_s: f64) -> Settings {
    let per_root_s = libm::sqrt(step_s);
    let Imu { gyro, accel, .. } = imu;
    let gyro_noise = root(&[
        gyro.noise_rad_s_rthz / libm::sqrt(2.0),
        step(gyro.lsb_rad_s) * per_root_s,
        vibration(gyro.vibration_rad_s, imu, rotors) * per_root_s,
        root(&[gyro.scale, gyro.misalignment_rad]) * TURNING_RAD_S,
    ]);
    let accel_noise = root(&[
        accel.noise_m_s2_rthz / libm::sqrt(2.0),
        step(accel.lsb_m_s2) * per_root_s,
        vibration(accel.vibration_m_s2, imu, rotors) * per_root_s,
        root(&[accel.scale, accel.misalignment_rad]) * SPEEDING_M_S2,
    ]);
    // What a Gauss-Markov process adds per root of a second.
    let markov = |sigma: f64, time_s: f64| sigma * libm::sqrt(2.0 / time_s);
    let gyro_walk = root(&[gyro.walk_rad_s2_rthz, markov(gyro.instability_rad_s, gyro.instability_time_s)]);
    // Misaligned axes make of a turn about the vertical a tilt, the same at each turn, which is not to be told from a
    // bias of the accelerometer.
    let leaning = markov(gyro.misalignment_rad * gravity_m_s2, LEANING_S);
    let accel_walk = markov(accel.instability_m_s2, accel.instability_time_s);
    let accel_walk = root(&[accel.walk_m_s3_rthz, accel_walk, leaning]);
    let accel_bias = root(&[accel.bias_m_s2, accel.instability_m_s2, accel.scale * gravity_m_s2]);
    let accel_bias = root(&[accel_bias, accel.misalignment_rad * gravity_m_s2]);
    let drift = suite.barometer.map_or(0.0, |it| markov(it.drift_m, it.drift_time_s));
    let range = |range: f64, most: f64| if range > 0.0 { range.min(most) as f32 } else { most as f32 };
    // A perfect sensor at rest says the same again and again.
    let is_noisy = |noise: f64, lsb: f64| noise > 0.0 && noise / per_root_s > lsb;
    let moves = is_noisy(gyro.noise_rad_s_rthz, gyro.lsb_rad_s) || is_noisy(accel.noise_m_s2_rthz, accel.lsb_m_s2);
    let differs = suite.tracker.is_none_or(|it| it.position_m > 0.0 || it.attitude_rad > 0.0)
        && suite.magnetometer.is_none_or(|it| it.noise_ut > it.lsb_ut / 4.0);
    let most = |value: f64, low: f64, high: f64| value.clamp(low, high) as f32;
    Settings {
        gravity_m_s2: gravity_m_s2 as f32,
        gyro_noise_rad_s_rthz: most(gyro_noise, 1e-5, 0.1),
        accel_noise_m_s2_rthz: most(accel_noise, 1e-4, 1.0),
        gyro_walk_rad_s_rts: most(gyro_walk, 1e-6, 0.01),
        accel_walk_m_s2_rts: most(accel_walk, 1e-5, 0.1),
        accel_bias_m_s2: most(accel_bias, 1e-3, 1.0),
        gyro_bias_max_rad_s: most(5.0 * gyro.bias_rad_s, 0.35, 1.0),
        baro_walk_m_rts: most(drift, 1e-4, 1.0),
        gnss_noise_m: suite.gnss.map_or(Settings::DEFAULT.gnss_noise_m, |it| most(it.noise_m, 0.01, 1000.0)),
        gnss_slow_s: suite.gnss.map_or(Settings::DEFAULT.gnss_slow_s, |it| most(it.correlation_time_s, 1.0, 1e5)),
        mag_slow_rad: suite.magnetometer.map_or(Settings::DEFAULT.mag_slow_rad, |it| most(iron(&it), 0.0, 1.0)),
        declination_rad: suite.magnetometer.map_or(0.0, |it| it.declination_rad.clamp(-3.2, 3.2)) as f32,
        gyro_range_rad_s: range(gyro.range_rad_s, 100.0),
        accel_range_m_s2: range(accel.range_m_s2, 1000.0),
        stuck_s: if moves { Settings::DEFAULT.stuck_s } else { 0.0 },
        frozen_s: if differs { Settings::DEFAULT.frozen_s } else { 0.0 },
        ..Settings::DEFAULT
    }
}

/// The calibration of a mounted inertial sensor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Calibration {
    /// Sensor to body axes.
    to_body: Matrix3<f64>,
    position_m: Vector3<f64>,
    step_s: f64,
    /// Rates of the last sample, body frame \[rad/s\].
    last: Option<Vector3<f64>>,
}

impl Calibration {
    pub(super) fn new(mounting: &Mounting, step_s: f64) -> Self {
        let columns = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| mounting.to_body(&axis));
        let to_body = Matrix3::from_columns(&columns);
        Calibration { to_body, position_m: mounting.position_m, step_s, last: None }
    }

    /// Returns rates and the specific force of the centre of mass, body frame: what the sensor feels less
    /// d omega/dt x r + omega x (omega x r), with the derivative from the last sample to this one.
    pub(super) fn sample(&mut self, reading: &ImuReading, at_us: u64) -> ImuSample {
        let omega = self.to_body * reading.rates_rad_s;
        let change = self.last.replace(omega).map_or(Vector3::zeros(), |last| (omega - last) / self.step_s);
        let r = &self.position_m;
        let force = self.to_body * reading.specific_force_m_s2 - change.cross(r) - omega.cross(&omega.cross(r));
        ImuSample { at_us, rates_rad_s: omega.cast(), specific_force_m_s2: force.cast() }
    }
}

/// Tells a value of `time_s` on the clock that `at_us` converts to.
fn timed(value: Measurement, time_s: f64, at_us: impl Fn(f64) -> u64) -> Stamped<Measurement> {
    Stamped { value, at_us: at_us(time_s) }
}

fn sigma(parts: &[f64]) -> f32 {
    root(parts).max(SIGMA_MIN) as f32
}

/// Tells a pose.
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

/// Tells a fix, as good as the receiver says.
pub(super) fn gnss(fix: &GnssFix, at_us: impl Fn(f64) -> u64) -> Stamped<Measurement> {
    let value = Measurement::Gnss {
        position_m: fix.position_m.cast(),
        velocity_m_s: fix.velocity_m_s.cast(),
        horizontal_sigma_m: sigma(&[fix.horizontal_sigma_m]),
        vertical_sigma_m: sigma(&[fix.vertical_sigma_m]),
        speed_sigma_m_s: sigma(&[fix.velocity_sigma_m_s]).max(1e-3),
    };
    timed(value, fix.true_at_s, at_us)
}

/// Tells a height.
pub(super) fn height(fix: &HeightFix, barometer: &Barometer, at_us: impl Fn(f64) -> u64) -> Stamped<Measurement> {
    let sigma_m = sigma(&[barometer.noise_m, step(barometer.lsb_m)]);
    timed(Measurement::Height { height_m: fix.height_m as f32, sigma_m }, fix.true_at_s, at_us)
}

/// Tells a field: its noise; what hard and soft iron and the motors add is told by the settings.
pub(super) fn field(fix: &FieldFix, part: &Magnetometer, at_us: impl Fn(f64) -> u64) -> Stamped<Measurement> {
    let sigma = sigma(&[part.noise_ut, step(part.lsb_ut)]);
    timed(Measurement::MagneticField { field: fix.field_ut.cast(), sigma }, fix.true_at_s, at_us)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "what cannot be built must stop the test")]
mod tests {
    use super::Calibration;
    use afbc_plant::instruments::{Imu, Mounting};
    use afbc_plant::{Environment, InstrumentSuite, Instruments, Motion, Plant, PlantModel, Truth};
    use afbc_types::Parameters;
    use nalgebra::Vector3;

    /// What a perfect sensor feels anywhere on the vehicle, calibrated, is what the centre of mass feels.
    #[test]
    fn a_calibrated_sensor_is_at_the_centre_of_mass() {
        const STEP_S: f64 = 0.001;
        let plant = Plant::new(PlantModel::RigidBody, Motion::default(), Environment::calm(Parameters::PAPER).unwrap());
        let mounting =
            Mounting { position_m: Vector3::new(0.2, -0.1, 0.05), attitude_rad: Vector3::new(3.0, -0.4, 1.2) };
        let suite = InstrumentSuite { imu: Some(Imu { mounting, ..Imu::DEFAULT }), ..InstrumentSuite::default() };
        let mut instruments = Instruments::new(&suite, &[], 1, STEP_S).unwrap();
        let mut calibration = Calibration::new(&mounting, STEP_S);
        let spin = Vector3::new(20.0, -30.0, 10.0);
        for step in 0..100 {
            let time_s = f64::from(step) * STEP_S;
            let rates_rad_s = Vector3::new(3.0, -5.0, 2.0) + spin * time_s;
            let truth = Truth { time_s, rates_rad_s, angular_acceleration_rad_s2: spin, ..plant.truth() };
            let sample = calibration.sample(&instruments.measure(&truth).imu.unwrap(), 0);
            let rates = sample.rates_rad_s.cast::<f64>() - rates_rad_s;
            let force = sample.specific_force_m_s2.cast::<f64>() - truth.specific_force_m_s2();
            assert!(rates.norm() < 1e-5, "{rates}");
            // The first sample has no derivative.
            assert!(step == 0 || force.norm() < 1e-3, "{force}");
        }
    }
}

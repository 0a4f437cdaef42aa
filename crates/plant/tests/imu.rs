//! Compares the IMU with its declared properties, within five standard errors and with fixed seeds.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::float_cmp, missing_docs)] // tests

use crate::common;
use afbc_plant::instruments::{AccelerometerModel, GyroscopeModel, ImuModel, ImuReading};
use afbc_plant::{
    Drag, Environment, InstrumentSuite, Motion, Plant, PlantModel, Realism, Rotors, Truth, Turbulence, Wind,
};
use afbc_types::{Mounting, Parameters, RotorSpeeds};
use common::{STEP_S, assert_correlation, assert_sigma, assert_sigma_of, coordinates, instruments, mean, rest, run};
use core::f64::consts::{PI, TAU};
use nalgebra::{UnitQuaternion, Vector3, Vector4};

const G: f64 = 9.81;

fn with(imu: ImuModel) -> InstrumentSuite {
    InstrumentSuite { imu: Some(imu), ..InstrumentSuite::default() }
}

fn gyro(gyro: GyroscopeModel) -> InstrumentSuite {
    with(ImuModel { gyro, ..ImuModel::DEFAULT })
}

fn samples(suite: InstrumentSuite, seed: u64, steps: u32, truth: impl Fn(u32) -> Truth) -> Vec<ImuReading> {
    run(suite, seed, steps, truth).into_iter().map(|readings| readings.imu.unwrap()).collect()
}

#[test]
fn a_perfect_one_reads_the_truth() {
    let truth = Truth { rates_rad_s: Vector3::new(0.1, -0.2, 0.3), ..rest() };
    for (k, sample) in (0..).zip(samples(with(ImuModel::DEFAULT), 1, 10, |_| truth)) {
        assert_eq!(sample.at_s, f64::from(k) * STEP_S);
        assert_eq!(sample.rates_rad_s, truth.rates_rad_s);
        assert!((sample.specific_force_m_s2 - Vector3::z() * G).norm() < 1e-12);
    }
}

/// Returns the Allan variance of means over `m` samples each, without overlap.
fn allan(x: &[f64], m: usize) -> f64 {
    let means: Vec<f64> = x.chunks_exact(m).map(mean).collect();
    means.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum::<f64>() / (2.0 * (means.len() - 1) as f64)
}

/// White noise of one-sided density n has an Allan variance of n^2/(2 tau), with and without the anti-alias filter,
/// whose correlation time is far below tau.
#[test]
fn noise_has_the_declared_density() {
    for preset in ImuModel::PRESETS {
        for filtered in [false, true] {
            let ImuModel { gyro, accel, .. } = preset.settings;
            let cutoff = |hz| if filtered { hz } else { 0.0 };
            let imu = ImuModel {
                gyro: GyroscopeModel {
                    noise_rad_s_rthz: gyro.noise_rad_s_rthz,
                    cutoff_hz: cutoff(gyro.cutoff_hz),
                    ..GyroscopeModel::DEFAULT
                },
                accel: AccelerometerModel {
                    noise_m_s2_rthz: accel.noise_m_s2_rthz,
                    cutoff_hz: cutoff(accel.cutoff_hz),
                    ..AccelerometerModel::DEFAULT
                },
                ..ImuModel::DEFAULT
            };
            let samples = samples(with(imu), 3, 400_000, |_| rest());
            let axis = |of: fn(&ImuReading) -> f64| samples.iter().map(of).collect::<Vec<f64>>();
            let checked = [
                (gyro.noise_rad_s_rthz, axis(|s| s.rates_rad_s.x)),
                (gyro.noise_rad_s_rthz, axis(|s| s.rates_rad_s.z)),
                (accel.noise_m_s2_rthz, axis(|s| s.specific_force_m_s2.y)),
                (accel.noise_m_s2_rthz, axis(|s| s.specific_force_m_s2.z - G)),
            ];
            for (density, x) in checked {
                for m in [50, 200, 1000] {
                    let tau_s = m as f64 * STEP_S;
                    let ratio = allan(&x, m) / (density * density / (2.0 * tau_s));
                    // The differences overlap by half: variance 3 divided by their number. The filter takes 1 % at 50
                    // ms.
                    let bound = 5.0 * (3.0 / (x.len() / m) as f64).sqrt() + 0.02;
                    assert!((ratio - 1.0).abs() < bound, "{} {filtered} {m}: {ratio}", preset.name);
                }
                if !filtered {
                    assert_sigma(&x, density * (0.5 / STEP_S).sqrt(), preset.name);
                    let pairs: Vec<_> = x.windows(2).map(|w| (w[0], w[1])).collect();
                    assert_correlation(&pairs, density * (0.5 / STEP_S).sqrt(), 0.0, preset.name);
                }
            }
        }
    }
}

/// Over many flights the instability has its stationary deviation, at the start and later, and its correlation falls to
/// 1/e after the correlation time.
#[test]
fn instability_is_stationary_and_correlated() {
    let gyro = GyroscopeModel { instability_rad_s: 0.01, instability_time_s: 0.05, ..GyroscopeModel::DEFAULT };
    let accel = AccelerometerModel { instability_m_s2: 0.2, instability_time_s: 0.1, ..AccelerometerModel::DEFAULT };
    let (mut slow, mut fast) = (Vec::new(), Vec::new());
    for seed in 0..3000 {
        let mut instruments = instruments(with(ImuModel { gyro, accel, ..ImuModel::DEFAULT }), seed);
        let start = instruments.imu_bias().unwrap();
        for k in 0..100 {
            let sample = instruments.measure(&common::at(rest(), k)).imu.unwrap();
            let bias = instruments.imu_bias().unwrap();
            assert_eq!(sample.rates_rad_s, bias.rates_rad_s, "what is told is what is added");
        }
        let end = instruments.imu_bias().unwrap();
        for i in 0..3 {
            fast.push((start.rates_rad_s[i], end.rates_rad_s[i]));
            slow.push((start.specific_force_m_s2[i], end.specific_force_m_s2[i]));
        }
    }
    for (pairs, sigma, correlation) in [(fast, 0.01, (-2.0_f64).exp()), (slow, 0.2, (-1.0_f64).exp())] {
        let (start, end): (Vec<f64>, Vec<f64>) = pairs.iter().copied().unzip();
        assert_sigma(&start, sigma, "start");
        assert_sigma(&end, sigma, "end");
        assert_correlation(&pairs, sigma, correlation, "instability");
    }
}

/// Constant errors have their spread over flights and none within one; the walk grows with the root of time.
#[test]
fn bias_scale_and_misalignment_are_drawn_once_and_the_walk_grows() {
    let gyro = GyroscopeModel { bias_rad_s: 0.05, scale: 0.01, misalignment_rad: 0.003, ..GyroscopeModel::DEFAULT };
    let accel = AccelerometerModel { bias_m_s2: 0.3, walk_m_s3_rthz: 0.1, ..AccelerometerModel::DEFAULT };
    let suite = with(ImuModel { gyro, accel, ..ImuModel::DEFAULT });
    let (mut bias, mut scale, mut skew, mut walk, mut constant) = (vec![], vec![], vec![], vec![], vec![]);
    for seed in 0..3000 {
        let turning = |k: u32| Truth { rates_rad_s: if k == 0 { Vector3::zeros() } else { unit(k) }, ..rest() };
        let samples = samples(suite, seed, 6, turning);
        assert_eq!(samples[0].rates_rad_s, samples[4].rates_rad_s);
        bias.push(samples[4].rates_rad_s);
        for i in 0..3 {
            let column = samples[i + 1].rates_rad_s - samples[0].rates_rad_s;
            for j in 0..3 {
                if i == j { scale.push(column[j] - 1.0) } else { skew.push(column[j]) }
            }
        }
        let force = |k: usize| samples[k].specific_force_m_s2 - Vector3::z() * G;
        constant.push(force(0));
        walk.push(force(5) - force(0));
    }
    assert_sigma(&coordinates(bias), 0.05, "bias");
    assert_sigma(&scale, 0.01, "scale");
    assert_sigma(&skew, 0.003, "misalignment");
    // The walk has gone one step at the first sample and five more at the last.
    assert_sigma(&coordinates(constant), (0.09 + 0.01 * STEP_S).sqrt(), "constant");
    assert_sigma(&coordinates(walk), 0.1 * (5.0 * STEP_S).sqrt(), "walk");
}

/// Returns one rad/s about axis 1 to 3, or rest for other numbers.
fn unit(k: u32) -> Vector3<f64> {
    Vector3::from_fn(|i, _| if i + 1 == k as usize { 1.0 } else { 0.0 })
}

#[test]
fn output_is_quantised_and_clipped() {
    let accel =
        AccelerometerModel { lsb_m_s2: 0.01, range_m_s2: 20.0, noise_m_s2_rthz: 0.02, ..AccelerometerModel::DEFAULT };
    let gyro = GyroscopeModel { lsb_rad_s: 0.25, range_rad_s: 3.0, ..GyroscopeModel::DEFAULT };
    let truth = |k: u32| Truth { rates_rad_s: Vector3::new(0.01, -0.01, 0.001) * f64::from(k), ..rest() };
    let samples = samples(with(ImuModel { gyro, accel, ..ImuModel::DEFAULT }), 4, 1000, truth);
    for (k, sample) in (0..).zip(&samples) {
        let expected = truth(k).rates_rad_s.map(|rate| (rate.clamp(-3.0, 3.0) / 0.25).round_ties_even() * 0.25);
        assert_eq!(sample.rates_rad_s, expected);
        for value in &sample.specific_force_m_s2 {
            let steps = value / 0.01;
            assert!((steps - steps.round()).abs() < 1e-9, "{value}");
        }
    }
    let different = samples.iter().map(|s| s.specific_force_m_s2.z.to_bits());
    assert!(different.collect::<std::collections::BTreeSet<_>>().len() > 50);
    // The force is clipped on either side, with or without noise.
    let falling = |_| Truth { acceleration_m_s2: Vector3::new(50.0, -50.0, 0.0), ..rest() };
    let clipped = common::run(with(ImuModel { gyro, accel, ..ImuModel::DEFAULT }), 4, 10, falling);
    assert!(clipped.iter().all(|r| r.imu.unwrap().specific_force_m_s2.xy() == nalgebra::Vector2::new(20.0, -20.0)));
}

/// An oscillating rate is attenuated by the Butterworth filter's gain at the frequency warped by the bilinear
/// transform: half the power at the cut-off, no attenuation of a constant.
#[test]
fn oscillations_above_the_cut_off_are_attenuated() {
    let cutoff_hz = 80.0;
    let suite = gyro(GyroscopeModel { cutoff_hz, ..GyroscopeModel::DEFAULT });
    for frequency_hz in [0.0, 10.0, 40.0, 80.0, 120.0, 200.0, 400.0] {
        let phase = |k: u32| TAU * frequency_hz * f64::from(k) * STEP_S;
        let samples = samples(suite, 1, 3000, |k| Truth { rates_rad_s: Vector3::x() * phase(k).cos(), ..rest() });
        // Whole periods after the transient.
        let (mut c, mut s) = (0.0, 0.0);
        for (k, sample) in (0..).zip(&samples).skip(1000) {
            (c, s) = (c + sample.rates_rad_s.x * phase(k).cos(), s + sample.rates_rad_s.x * phase(k).sin());
        }
        let found = c.hypot(s) / if frequency_hz == 0.0 { 2000.0 } else { 1000.0 };
        let warped = (PI * frequency_hz * STEP_S).tan() / (PI * cutoff_hz * STEP_S).tan();
        let expected = 1.0 / (1.0 + warped.powi(4)).sqrt();
        assert!((found - expected).abs() < 1e-6, "{frequency_hz} Hz: {found}, not {expected}");
        if frequency_hz == cutoff_hz {
            assert!((found * found - 0.5).abs() < 1e-6);
        }
    }
}

/// A sensor beside the centre of mass measures the acceleration of its own position in its own axes, also with an
/// unstated lever. Compared with the second difference of that position's path in a tumbling flight.
#[test]
fn a_mounted_sensor_feels_its_own_place() {
    const DT_S: f64 = 1e-4;
    let mounting = Mounting { position_m: Vector3::new(0.05, -0.03, 0.02), attitude_rad: Vector3::new(0.3, -0.2, 2.5) };
    let initial = Motion { rates_rad_s: Vector3::new(4.0, -3.0, 6.0), ..Motion::default() };
    let mut plant = Plant::new(PlantModel::RigidBody, initial, Environment::calm(Parameters::PAPER).unwrap());
    let lever_m = Vector3::new(-0.02, 0.01, 0.04);
    let told = Mounting { position_m: mounting.position_m - lever_m, ..mounting };
    let imu = ImuModel { mounting: told, lever_m, ..ImuModel::DEFAULT };
    let mut sensor = afbc_plant::SimulatedInstruments::new(&with(imu), &[], 1, DT_S).unwrap();
    let axes = {
        let a = mounting.attitude_rad;
        UnitQuaternion::from_euler_angles(a.x, a.y, a.z)
    };
    let (mut path, mut felt, mut lever) = (Vec::new(), Vec::new(), 0.0_f64);
    for _ in 0..2000 {
        plant.step(&RotorSpeeds(Vector4::new(190.0, 205.0, 210.0, 195.0)), DT_S);
        let truth = plant.truth();
        let body = UnitQuaternion::new_normalize(truth.attitude);
        path.push((truth.position_m + body * mounting.position_m, body, truth.rates_rad_s));
        let sample = sensor.measure(&truth).imu.unwrap();
        lever = lever.max((axes * sample.specific_force_m_s2 - truth.specific_force_m_s2()).norm());
        felt.push(sample);
    }
    assert!(lever > 1.0, "the lever is felt: {lever}");
    for (places, sample) in path.windows(3).zip(&felt[1..]) {
        let [(before, ..), (now, body, rates), (after, ..)] = places else { unreachable!() };
        let acceleration = (after - now * 2.0 + before) / (DT_S * DT_S);
        let expected = axes.inverse() * (body.inverse() * (acceleration + Vector3::z() * G));
        assert!((sample.specific_force_m_s2 - expected).norm() < 1e-3, "{expected:?}");
        assert!((sample.rates_rad_s - axes.inverse() * rates).norm() < 1e-12);
        assert!((axes * sample.rates_rad_s - rates).norm() < 1e-12);
    }
}

/// Returns speeds around hover that keep the vehicle near the origin, on a wandering course.
fn feedback(motion: &Motion, time_s: f64) -> RotorSpeeds<4> {
    let Motion { position_m: position, velocity_m_s: velocity, attitude_rad: eta, rates_rad_s: rates } = motion;
    let aim = Vector3::new((0.9 * time_s).sin(), (0.7 * time_s).cos() - 1.0, 0.3 * (0.5 * time_s).sin());
    let off = position - aim;
    let roll = 8.0 * rates.x + 40.0 * (eta.x - 0.1 * velocity.y - 0.05 * off.y);
    let pitch = 8.0 * rates.y + 40.0 * (eta.y + 0.1 * velocity.x + 0.05 * off.x);
    let (up, yaw) = (200.0 - 20.0 * off.z - 20.0 * velocity.z, 3.0 * (1.3 * time_s).sin());
    RotorSpeeds(Vector4::new(up + roll + yaw, up + pitch - yaw, up - roll + yaw, up - pitch - yaw).map(|w| w as f32))
}

/// Integrating the readings of a perfect sensor, with the mean of two successive samples, gives the position after ten
/// seconds of turbulent flight, so frames, signs and gravity agree. Each sample is late by at most a step, because a
/// step's load is new: 1 ms of 5 m/s2 is 5 mm/s.
#[test]
fn a_perfect_one_navigates() {
    for model in [PlantModel::RigidBody, PlantModel::Simplified] {
        let realism = Realism {
            rotors: Rotors { time_constant_s: 0.02, max_rad_s: 317.0, ..Rotors::default() },
            drag: Some(Drag::PAPER),
            wind: Wind {
                steady_m_s: Vector3::new(2.0, -1.0, 0.0),
                turbulence: Some(Turbulence::LIGHT),
                ..Wind::default()
            },
            ..Realism::default()
        };
        let environment = Environment::calm(Parameters::PAPER).unwrap();
        let mut plant = Plant::with_realism(model, Motion::default(), environment, &realism, STEP_S).unwrap();
        let mut sensor = instruments(with(ImuModel::DEFAULT), 1);
        let mut last = sensor.measure(&plant.truth()).imu.unwrap();
        let (mut q, mut v, mut p) = (UnitQuaternion::identity(), Vector3::zeros(), Vector3::zeros());
        let (mut travelled, mut tilt) = (0.0, 0.0_f64);
        for k in 0..10_000 {
            plant.step(&feedback(&plant.motion(), f64::from(k) * STEP_S), STEP_S);
            let now = sensor.measure(&plant.truth()).imu.unwrap();
            let before = q * last.specific_force_m_s2;
            q *= UnitQuaternion::from_scaled_axis((last.rates_rad_s + now.rates_rad_s) * (STEP_S / 2.0));
            let a = (before + q * now.specific_force_m_s2) / 2.0 - Vector3::z() * G;
            p += v * STEP_S + a * (STEP_S * STEP_S / 2.0);
            v += a * STEP_S;
            last = now;
            travelled += v.norm() * STEP_S;
            tilt = tilt.max(plant.motion().attitude_rad.xy().norm());
        }
        let truth = plant.truth();
        assert!(travelled > 3.0 && tilt > 0.1, "{travelled} m, {tilt} rad");
        assert!((v - truth.velocity_m_s).norm() < 0.01, "{:?}", v - truth.velocity_m_s);
        assert!((p - truth.position_m).norm() < 0.05, "{:?}", p - truth.position_m);
        assert!(q.angle_to(&UnitQuaternion::new_normalize(truth.attitude)) < 1e-3);
    }
}

/// Each rotor shakes the body at k omega/2 pi, with amplitudes that grow with omega^2. There is nothing between the
/// lines, and the filter attenuates each line by its analogue gain.
#[test]
fn vibration_is_at_the_rotors_harmonics_and_grows_with_the_square_of_the_speed() {
    const STEPS: u32 = 4000;
    let hover = rest().hover_rad_s;
    for (factor, cutoff_hz) in [(1.0, 0.0), (1.5, 0.0), (1.5, 60.0)] {
        // Whole multiples of 0.25 Hz, so that the lines are orthogonal over four seconds.
        let speeds = [30.0, 31.5, 33.0, 36.0].map(|hz: f64| TAU * hz * factor);
        let mut truth = rest();
        truth.rotor_speeds_rad_s.fill(0.0);
        speeds.iter().zip(truth.rotor_speeds_rad_s.iter_mut()).for_each(|(speed, lane)| *lane = *speed);
        let accel = AccelerometerModel { vibration_m_s2: 2.0, cutoff_hz, ..AccelerometerModel::DEFAULT };
        let gyro = GyroscopeModel { vibration_rad_s: 0.1, cutoff_hz, ..GyroscopeModel::DEFAULT };
        let harmonics = Vector3::new(1.0, 0.5, 0.25);
        let samples = samples(with(ImuModel { gyro, accel, harmonics, ..ImuModel::DEFAULT }), 5, STEPS, |_| truth);
        for (sensor, size) in [(0, 0.1), (1, 2.0)] {
            for axis in 0..3 {
                let mut x: Vec<f64> = samples
                    .iter()
                    .map(|s| [s.rates_rad_s, s.specific_force_m_s2 - Vector3::z() * G][sensor][axis])
                    .collect();
                for speed in speeds {
                    for k in 1..=3 {
                        let at = |i: usize| f64::from(k) * speed * i as f64 * STEP_S;
                        let c =
                            x.iter().enumerate().map(|(i, x)| x * at(i).cos()).sum::<f64>() * 2.0 / f64::from(STEPS);
                        let s =
                            x.iter().enumerate().map(|(i, x)| x * at(i).sin()).sum::<f64>() * 2.0 / f64::from(STEPS);
                        let ratio = f64::from(k) * speed / TAU / cutoff_hz.max(1e-9);
                        let gain = if cutoff_hz > 0.0 { 1.0 / (1.0 + ratio.powi(4)).sqrt() } else { 1.0 };
                        let expected = size * harmonics[k as usize - 1] * (speed / hover).powi(2) * gain;
                        assert!((c.hypot(s) / expected - 1.0).abs() < 1e-6, "{speed} {k}: {} {expected}", c.hypot(s));
                        x.iter_mut().enumerate().for_each(|(i, x)| *x -= c * at(i).cos() + s * at(i).sin());
                    }
                }
                assert!(x.iter().all(|x| x.abs() < 1e-6 * size), "nothing else");
            }
        }
    }
    // Rotors that stand still shake nothing.
    let mut still = rest();
    still.rotor_speeds_rad_s.fill(0.0);
    let accel = AccelerometerModel { vibration_m_s2: 2.0, ..AccelerometerModel::DEFAULT };
    let quiet = samples(with(ImuModel { accel, ..ImuModel::DEFAULT }), 5, 10, |_| still);
    assert!(quiet.iter().all(|s| s.specific_force_m_s2.xy().norm() == 0.0));
}

/// Vibration, bias and distortion do not change the drawn white noise.
#[test]
fn settings_do_not_change_the_noise() {
    let noisy = GyroscopeModel { noise_rad_s_rthz: 1e-4, ..GyroscopeModel::DEFAULT };
    let other = GyroscopeModel { vibration_rad_s: 0.1, bias_rad_s: 0.02, ..noisy };
    let plain = samples(gyro(noisy), 6, 1000, |_| rest());
    let mut still = rest();
    still.rotor_speeds_rad_s.fill(0.0);
    let biased = samples(gyro(other), 6, 1000, |_| still);
    let difference: Vec<_> = plain.iter().zip(&biased).map(|(a, b)| b.rates_rad_s - a.rates_rad_s).collect();
    assert!(difference[0].norm() > 1e-3);
    assert!(difference.iter().all(|d| (d - difference[0]).norm() < 1e-15));
    assert_sigma_of(&coordinates(plain.iter().map(|s| s.rates_rad_s)), 1e-4 * 500.0_f64.sqrt(), 3000.0, "noise");
}

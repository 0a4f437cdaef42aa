//! Flights with no aid but the barometer: position, velocity and heading are invalid.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)] // tests

use crate::common::{Flight, ICM, Imu, NOTHING, Noise, Sensors, V3, fly, settings};
use core::f64::consts::TAU;

const TIME_S: f64 = 90.0;

/// Returns a flight after two seconds of rest: three waves each along x and y with periods of 3 to 40 s, a root mean
/// square speed of `speed_m_s`, and at most 4 m/s2 per wave.
fn wandering(seed: u64, speed_m_s: f64) -> impl Fn(f64) -> (V3, f64) {
    let mut noise = Noise::new(seed);
    let mut waves = [[(0.0, 0.0, 0.0); 3]; 2];
    for axis in &mut waves {
        for wave in axis.iter_mut() {
            let omega = TAU / (3.0 * (40.0_f64 / 3.0).powf(noise.uniform()));
            let speed = (speed_m_s / 3.0_f64.sqrt() * noise.normal().abs()).min(4.0 / omega);
            *wave = (omega, speed, TAU * noise.uniform());
        }
    }
    let turns = 0.5 * noise.normal();
    move |t| {
        let x = ((t - 2.0) / 4.0).clamp(0.0, 1.0);
        let grown = x * x * x * x * (35.0 - 84.0 * x + 70.0 * x * x - 20.0 * x * x * x);
        let along = |axis: usize| -> f64 {
            let place =
                |(omega, speed, phase): &(f64, f64, f64)| speed / omega * ((omega * t + phase).sin() - phase.sin());
            waves[axis].iter().map(place).sum()
        };
        (V3::new(along(0), along(1), 2.0) * grown, turns * grown * (t - 2.0))
    }
}

/// The tilt error exceeds three sigma in less than one percent of the time, at 0.5 m/s as well as at 20 m/s, with the
/// true noise settings and with the defaults.
#[test]
fn the_tilt_is_as_good_as_is_said() {
    let known = settings(&ICM);
    let default = settings(&Imu { gyro: 1e-3, accel: 2e-2, gyro_walk: 5e-5, accel_walk: 3e-4, ..ICM });
    let baro = Sensors { baro: Some(0.15), ..NOTHING };
    for (name, told) in [("known", known), ("default", default)] {
        for speed_m_s in [0.5, 2.0, 8.0, 20.0] {
            let (mut nees, mut beyond, mut count) = (0.0, 0.0, 0.0);
            for seed in 0..4 {
                let truth = fly(wandering(seed, speed_m_s), TIME_S);
                let mut flight = Flight::with(&truth, ICM, baro, seed, told);
                for ms in 0..(TIME_S * 1e3) as usize {
                    let estimate = flight.step();
                    if ms > 10_000 && ms % 100 == 0 {
                        assert!(estimate.validity.attitude && !estimate.validity.velocity, "{name}, {ms} ms");
                        let (e, p) = (flight.errors(&estimate), flight.covariance());
                        nees += flight.nees::<2>(&estimate);
                        beyond += (0..2).filter(|k| e[*k] * e[*k] > 9.0 * p[(*k, *k)]).count() as f64 / 2.0;
                        count += 1.0;
                    }
                }
            }
            let (nees, beyond) = (nees / count, beyond / count);
            println!("{name}, {speed_m_s} m/s: NEES {nees:.2} of 2, {:.2} % beyond three sigma", 100.0 * beyond);
            assert!(nees < 4.0 && beyond < 0.01, "{name}, {speed_m_s} m/s: {nees}, {beyond}");
            // The tilt error by the accelerometer bias stays constant in a flight, so it is not averaged over time.
            assert!(nees > 0.3, "{name}, {speed_m_s} m/s: {nees}");
        }
    }
}

//! A recorded flight of an Iris against PX4's EKF2 over it. Skipped where the data are absent.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)] // tests

mod common;

use afbc_estimator::{Estimator, ImuSample, Measurement, Memory, Origin, Settings, Timed};
use common::{Rms, log, matrix};
use nalgebra::Vector3;
use std::fs;
use std::path::Path;

/// PX4's frames are north-east-down and forward-right-down.
fn flip(x: f64, y: f64, z: f64) -> Vector3<f32> {
    Vector3::new(x as f32, -y as f32, -z as f32)
}

#[test]
fn agrees_with_ekf2_on_a_recorded_flight() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let (Ok(samples), Ok(theirs)) =
        (fs::read_to_string(folder.join("ecl_iris_gps.csv")), fs::read_to_string(folder.join("ecl_iris_gps_ekf2.csv")))
    else {
        println!("skipped: no data in {}", folder.display());
        return;
    };
    // EKF2 reads the position as latitude 8.5 and longitude 47.4 degrees; its declination there is 0.6 degrees.
    let settings = Settings { declination_rad: 0.0097, ..Settings::DEFAULT };
    let estimator = Estimator::new(settings).unwrap();
    let mut memory = Memory::default();
    let mut origin = None;
    let mut ours = Vec::new();
    for line in samples.lines() {
        let mut words = line.split(',');
        let at_us: u64 = words.next().unwrap().parse().unwrap();
        let kind = words.next().unwrap();
        let n: Vec<f64> = words.map(|word| word.parse().unwrap()).collect();
        match kind {
            "imu" => {
                let sample = ImuSample {
                    at_us,
                    rates_rad_s: flip(n[3], n[4], n[5]),
                    specific_force_m_s2: flip(n[0], n[1], n[2]),
                };
                // The recorded rate is 250 Hz: the steps between have no sample.
                let estimate = estimator.step(&mut memory, at_us, Some(&sample));
                ours.push(estimate);
                for ms in 1..4 {
                    let _ = estimator.step(&mut memory, at_us + ms * 1000, None);
                }
            }
            "gps" => {
                let (altitude, latitude, longitude) = (n[0] * 1e-3, n[1] * 1e-7, n[2] * 1e-7);
                let origin = origin.get_or_insert_with(|| Origin::new(latitude, longitude, altitude).unwrap());
                memory.offer(&Timed {
                    // EKF2's delay of the receiver.
                    at_us: at_us - 110_000,
                    value: Measurement::Gnss {
                        position_m: origin.local(latitude, longitude, altitude),
                        velocity_m_s: flip(n[3], n[4], n[5]),
                        horizontal_sigma_m: 0.5,
                        vertical_sigma_m: 1.0,
                        speed_sigma_m_s: 0.3,
                    },
                });
            }
            "baro" => {
                memory.offer(&Timed { at_us, value: Measurement::Height { height_m: n[0] as f32, sigma_m: 0.5 } });
            }
            "mag" => memory.offer(&Timed {
                at_us,
                value: Measurement::MagneticField { field: flip(n[0], n[1], n[2]), sigma: 0.02 },
            }),
            _ => {}
        }
    }
    let (mut attitude, mut velocity, mut position) = (Rms::default(), Rms::default(), Rms::default());
    let mut compared = 0;
    for line in theirs.lines().skip(1) {
        let n: Vec<f64> = line.split(',').map(|word| word.parse().unwrap()).collect();
        let at_us = n[0] as u64;
        // From ten seconds on, up to the last sample.
        if !(10_000_000..34_500_000).contains(&at_us) {
            continue;
        }
        let own = ours.iter().rfind(|estimate| estimate.at_us <= at_us).unwrap();
        assert!(own.validity.attitude && own.validity.heading && own.validity.position, "{at_us} us");
        let q = [n[1] as f32, n[2] as f32, -n[3] as f32, -n[4] as f32];
        attitude.add(log(&(matrix(own.attitude) * matrix(q).transpose())).norm().to_degrees());
        velocity.add(f64::from((own.state.velocity_m_s - flip(n[5], n[6], n[7])).norm()));
        position.add(f64::from((own.state.position_m - flip(n[8], n[9], n[10])).norm()));
        compared += 1;
    }
    assert!(compared > 200, "{compared}");
    let (attitude, velocity, position) = (attitude.value(), velocity.value(), position.value());
    println!("root mean square of the differences: {attitude} deg, {velocity} m/s, {position} m");
    assert!(attitude < 2.0 && velocity < 0.3 && position < 1.0, "{attitude} deg, {velocity} m/s, {position} m");
    let aids = memory.aids();
    let last = ours.last().unwrap();
    assert_eq!((last.resets.position, last.resets.velocity, last.resets.heading, last.resets.restarts), (1, 0, 0, 0));
    assert_eq!(aids.gnss_position.rejected + aids.height.rejected + aids.heading.rejected, 0);
}

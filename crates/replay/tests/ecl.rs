//! Replays PX4-ECL logs that the test writes itself.
#![allow(clippy::unwrap_used, missing_docs, reason = "tests")]

mod common;

use afbc_replay::{Replayed, fly, read};
use common::{HOME, PER_DEGREE, file, truth};
use std::fmt::Write;

/// Writes a log of 25 s and replays it. `exchanged` swaps longitude and latitude. The origin of the log's estimate is
/// `away_m` higher than the first fix.
fn log(name: &str, exchanged: bool, away_m: f64) -> Replayed {
    let head: Vec<_> = (0..10).map(|index| format!("state[{index}]")).collect();
    let (mut log, mut estimate) = (String::new(), format!("Timestamp,{}\n", head.join(",")));
    for step in 1..6250_u32 {
        let (at_us, time_s) = (4000 * step, 0.004 * f64::from(step) - 3.0);
        let now = truth(time_s);
        let (s, c) = now.yaw.0.sin_cos();
        let body = |[n, e, d]: [f64; 3]| [c * n + s * e, c * e - s * n, d];
        let [fx, fy, fz] = body(now.acceleration);
        // The last bits of a real sensor always change.
        let noise = 1e-3 * f64::from(step % 7);
        writeln!(log, "{at_us},imu,{},{fy},{},0,0,{}", fx + noise, fz - 9.81, now.yaw.1).unwrap();
        if step % 5 == 0 {
            // The declination belongs to the place as written.
            let (s, c) = if exchanged { 0.011_f64 } else { 0.059 }.sin_cos();
            let [x, y, z] = body([0.21 * c, 0.21 * s, 0.43]);
            writeln!(log, "{at_us},mag,{x},{y},{z}\n{at_us},baro,{}", HOME[2] - now.position[2]).unwrap();
        }
        if step % 50 == 0 {
            let then = truth(time_s - 0.11);
            let [n, e, d] = then.position;
            let (lat, lon) = ((HOME[0] + n / PER_DEGREE[0]) * 1e7, (HOME[1] + e / PER_DEGREE[1]) * 1e7);
            let (first, second) = if exchanged { (lon, lat) } else { (lat, lon) };
            let [vn, ve, vd] = then.velocity;
            writeln!(log, "{at_us},gps,{},{first:.0},{second:.0},{vn},{ve},{vd}", (HOME[2] - d) * 1e3).unwrap();
        }
        if step % 25 == 0 {
            let (s, c) = (0.5 * now.yaw.0).sin_cos();
            let ([n, e, d], [vn, ve, vd]) = (now.position, now.velocity);
            writeln!(estimate, "{at_us},{c},0,0,{s},{vn},{ve},{vd},{n},{e},{}", d - away_m).unwrap();
        }
    }
    file(&format!("{name}_ekf2.csv"), estimate.as_bytes());
    fly(&read(&file(&format!("{name}.csv"), log.as_bytes())).unwrap(), None).unwrap()
}

/// The velocity reveals the order of latitude and longitude. An estimate's origin that cannot be the first fix is found
/// at the first compared time. An offset of a few metres counts as a difference.
#[test]
fn order_and_origin_are_found() {
    for exchanged in [false, true] {
        for away_m in [0.0, 3.0, 365.0] {
            let replayed = log(&format!("ecl-{exchanged}-{away_m}"), exchanged, away_m);
            let [horizontal, height, velocity] = [
                replayed.figures.horizontal.rms().unwrap(),
                replayed.figures.height.rms().unwrap(),
                replayed.figures.velocity.rms().unwrap(),
            ];
            let off_m = if away_m == 3.0 { 3.0 } else { 0.0 };
            let what = format!("exchanged {exchanged}, {away_m} m: {horizontal}, {height}, {velocity}");
            println!("{what}");
            assert!(horizontal < 0.3 && (height - off_m).abs() < 0.1 && velocity < 0.1, "{what}");
            let moved_m = replayed.moved_m.map(|by| by.z.round());
            assert_eq!(moved_m, (away_m == 365.0).then_some(-365.0), "{what}");
        }
    }
}

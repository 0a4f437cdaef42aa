//! Helpers that run `sitl` in a folder for each test.

#![allow(dead_code, reason = "each test file uses a part")]

use core::panic::Location;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Returns an empty folder for a test of the calling file.
#[track_caller]
pub(crate) fn folder(test: &str) -> PathBuf {
    let file = Path::new(Location::caller().file()).file_stem().unwrap();
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("sitl").join(file).join(test);
    if folder.exists() {
        fs::remove_dir_all(&folder).unwrap();
    }
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// Returns a command that runs `sitl` in `folder`.
pub(crate) fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sitl"));
    command.current_dir(folder).args(arguments);
    command
}

/// Runs `sitl` in `folder`.
pub(crate) fn sitl(folder: &Path, arguments: &[&str]) -> Output {
    command(folder, arguments).output().unwrap()
}

/// Checks that a command succeeded; returns its output.
pub(crate) fn succeeds(output: &Output) -> String {
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// Checks that a command was refused; returns its error message.
pub(crate) fn refused(output: &Output) -> String {
    let error = String::from_utf8(output.stderr.clone()).unwrap();
    assert_eq!(output.status.code(), Some(2), "{error}");
    assert!(output.stdout.is_empty());
    error
}

/// Writes `rest.csv`, a log of `duration_s` at rest in the format of PX4-ECL, and an estimate next to it. The estimate
/// is off by 2 degrees in heading, 0.1 m/s to the north and 0.3 m to the east.
pub(crate) fn log_at_rest(folder: &Path, duration_s: u64) {
    let (mut log, mut seed) = (String::new(), 1_u64);
    let mut noise = |size: f64| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        size * ((seed >> 33) as f64 / f64::from(1_u32 << 30) - 1.0)
    };
    let head: Vec<_> = (0..24).map(|index| format!("state[{index}]")).collect();
    let mut estimate = format!("Timestamp,{}\n", head.join(","));
    let place = [85_456_073.0, 473_977_508.0].map(|number: f64| format!("{number}")).join(",");
    for step in 1..=250 * duration_s {
        let at_us = 4000 * step;
        let rates = [noise(1e-3), noise(1e-3), noise(1e-3)];
        let force = [noise(0.02), noise(0.02), noise(0.02) - 9.81];
        let numbers: Vec<_> = force.iter().chain(&rates).map(f64::to_string).collect();
        log += &format!("{at_us},imu,{}\n", numbers.join(","));
        if step % 5 == 0 {
            let [x, y, z] = [0.21 + noise(1e-3), noise(1e-3), 0.43 + noise(1e-3)];
            log += &format!("{at_us},mag,{x},{y},{z}\n{at_us},baro,{}\n", 488.0 + noise(0.1));
        }
        if step % 50 == 0 {
            log += &format!("{at_us},gps,488000,{place},{},{},{}\n", noise(0.01), noise(0.01), noise(0.01));
        }
        if step % 25 == 0 {
            let (s, c) = 1.0_f64.to_radians().sin_cos();
            let mut state = [0.0; 24];
            state[..10].copy_from_slice(&[c, 0.0, 0.0, s, 0.1, 0.0, 0.0, 0.0, 0.3, 0.0]);
            let state: Vec<_> = state.iter().map(f64::to_string).collect();
            estimate += &format!("{at_us},{}\n", state.join(","));
        }
    }
    fs::write(folder.join("rest.csv"), log).unwrap();
    fs::write(folder.join("rest_ekf2.csv"), estimate).unwrap();
}

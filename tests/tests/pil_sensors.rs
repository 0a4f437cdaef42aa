//! The firmware's machine code on an emulated Cortex-M4F flies on its own estimate, with every preset of an instrument
//! and once for a minute. No bit of the estimate and the rotor commands differs from the same code on the host.
#![allow(clippy::expect_used, clippy::panic, reason = "a test that cannot go on should say why")]

use afbc_hil::{Host, LoopEnd, MessagePeriods, Station, fly};
use afbc_plant::instruments::{BarometerModel, FailureKind, ImuModel, InstrumentFault, MagnetometerModel};
use afbc_scenario::{Scenario, built_in};
use core::ops::ControlFlow;
use pil::budget::{ESTIMATING_INSTRUCTIONS_MAX, ESTIMATING_INSTRUCTIONS_MEAN};
use pil::{Emulator, FirmwareImage, LockstepPair};
use std::io::Write as _;
use std::thread;

/// Returns flights with every inertial sensor indoors, and with every pair of barometer and magnetometer outdoors.
fn flights() -> Vec<Scenario> {
    let scenario = |name: &str| built_in(name).expect("built in").read().expect("valid");
    let with = |mut scenario: Scenario, imu: ImuModel| {
        // Vibration and mounting belong to the vehicle, not to the sensor.
        let Some(old) = scenario.instruments.imu else { panic!("{} has none", scenario.name) };
        let mut imu = ImuModel { mounting: old.mounting, ..imu };
        imu.gyro.vibration_rad_s = old.gyro.vibration_rad_s;
        imu.accel.vibration_m_s2 = old.accel.vibration_m_s2;
        scenario.instruments.imu = Some(imu);
        scenario
    };
    let parts = [ImuModel::ICM_42688_P, ImuModel::BMI270, ImuModel::MPU_6000];
    let indoors = parts.map(|imu| with(scenario("mocap"), imu));
    let pairs =
        [(BarometerModel::DPS310, MagnetometerModel::IST8310), (BarometerModel::BMP388, MagnetometerModel::QMC5883L)];
    let outdoors = pairs.into_iter().zip(parts).map(|((barometer, magnetometer), imu)| {
        let mut outdoors = with(scenario("outdoor"), imu);
        (outdoors.instruments.barometer, outdoors.instruments.magnetometer) = (Some(barometer), Some(magnetometer));
        outdoors
    });
    // The flight that reads the most sensors is the longest one. Emulation is slower than real time.
    let mut flights: Vec<_> = outdoors.chain(indoors).collect();
    for (index, flight) in flights.iter_mut().enumerate() {
        flight.duration_s = if index == 0 { 60.0 } else { 20.0 };
    }
    flights
}

/// Returns board and host. Returns none, with a message, if the emulator or its image is missing; fails under CI.
fn lockstep_or_skip() -> Option<LockstepPair> {
    match FirmwareImage::Pil.find().and_then(|image| Emulator::start(&image)) {
        Ok(emulator) => Some(LockstepPair::new(emulator, Host::new().expect("in range"))),
        Err(error) if error.is_missing() && std::env::var_os("CI").is_none() => {
            // println! would not do, since the test harness captures it.
            let _ = writeln!(std::io::stderr(), "SKIPPED, nothing was tested: {error}");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

/// Flies a scenario on board and host and compares them.
fn compare(scenario: &Scenario) {
    let Some(mut lockstep) = lockstep_or_skip() else { return };
    let mut off_m: f64 = 0.0;
    let end = fly(scenario, &mut Station::new(), &mut lockstep, MessagePeriods::LOCKSTEP, |sample| {
        // The vehicle starts away from the reference.
        let distance_m =
            if sample.time_s < 5.0 { 0.0 } else { (sample.motion.position_m - sample.reference.position_m).norm() };
        off_m = off_m.max(distance_m);
        ControlFlow::Continue(())
    });
    assert_eq!(end.expect("flown"), LoopEnd { lost: None, interrupted: false, disarmed: true }, "{}", scenario.name);
    let comparison = lockstep.comparison();
    println!("{}: at most {off_m:.3} m off, {comparison:?}", scenario.name);
    assert!(comparison.armed_ticks as f64 > 1e3 * scenario.duration_s, "{comparison:?}");
    assert_eq!(
        comparison.first_difference, None,
        "unless the image is older than the source (cargo fw-pil): {comparison:?}"
    );
    let instructions = &comparison.instructions;
    assert!(instructions.max() <= f64::from(ESTIMATING_INSTRUCTIONS_MAX), "{comparison:?}");
    assert!(instructions.mean() <= f64::from(ESTIMATING_INSTRUCTIONS_MEAN), "{comparison:?}");
    // Indoors it flies as well as with a tracker's states. Outdoors the receiver's error adds to the distance.
    let allowed_m = if scenario.instruments.tracker.is_some() { 0.02 } else { 6.0 };
    assert!(off_m < allowed_m, "{}: {off_m} m", scenario.name);
}

/// The inertial sensor fails, and later the tracker. Host and board fly on the tracker's poses, then without an
/// attitude, and give up in the same tick.
#[test]
fn what_is_left_of_the_sensors_is_the_hosts_bit_for_bit() {
    let mut scenario = built_in("mocap").expect("built in").read().expect("valid");
    scenario.duration_s = 9.0;
    let fault = |failure, start_s| InstrumentFault { failure, start_s, end_s: 9.0, rise_s: 0.0 };
    scenario.instrument_faults = vec![fault(FailureKind::ImuDead, 3.0), fault(FailureKind::TrackerLost, 6.0)];
    let Some(mut lockstep) = lockstep_or_skip() else { return };
    let end =
        fly(&scenario, &mut Station::new(), &mut lockstep, MessagePeriods::LOCKSTEP, |_| ControlFlow::Continue(()));
    let lost = end.expect("flown").lost.expect("nobody knows the attitude");
    let comparison = lockstep.comparison();
    assert!(lost.time_s > 8.0 && comparison.armed_ticks > 8_000, "{lost:?}, {comparison:?}");
    println!("{comparison:?}");
    assert_eq!((comparison.first_difference, comparison.differing_bits), (None, 0), "{comparison:?}");
    assert!(comparison.instructions.max() <= f64::from(ESTIMATING_INSTRUCTIONS_MAX), "{comparison:?}");
}

#[test]
fn the_estimate_is_the_hosts_bit_for_bit() {
    thread::scope(|threads| {
        for scenario in flights() {
            threads.spawn(move || compare(&scenario));
        }
    });
}

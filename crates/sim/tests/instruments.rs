//! Tests the instruments in scenario files.
#![allow(clippy::unwrap_used, missing_docs)] // tests

use afbc_files::read::FileError;
use afbc_plant::instruments::{BarometerModel, GnssModel, ImuModel, TrackerModel};
use afbc_plant::{InstrumentSuite, MeasurementDropouts, Truth};
use afbc_scenario::{Scenario, parse};
use nalgebra::Vector3;

fn example(text: &str) -> Result<Scenario, FileError> {
    let hover = "\n[trajectory]\nkind = \"hover\"\nposition_m = [0, 0, 1]\n";
    parse("example", &format!("{text}{hover}"), "example")
}

/// A part's name alone selects its preset. A table begins with its part's preset, or with a perfect instrument, and
/// changes only the given keys, also within groups.
#[test]
fn instruments_are_parts_or_tables() {
    let read = |text: &str| example(text).unwrap().instruments;
    assert_eq!(read(""), InstrumentSuite::default());
    let named = read("[instruments]\nimu = \"bmi270\"\ntracker = \"mocap-100\"\nbarometer = \"bmp388\"");
    let (imu, tracker) = (Some(ImuModel::BMI270), Some(TrackerModel::MOCAP_100));
    assert_eq!(
        named,
        InstrumentSuite { imu, tracker, barometer: Some(BarometerModel::BMP388), ..InstrumentSuite::default() }
    );
    let changed = "[instruments.imu]\npart = \"mpu-6000\"\ngyro.bias_rad_s = 0.5\naccel = { vibration_m_s2 = 3 }\n\
                   [instruments.gnss]\nrate_hz = 5\nloss = { rate_hz = 0.1, mean_s = 2 }";
    let mut imu = ImuModel::MPU_6000;
    (imu.gyro.bias_rad_s, imu.accel.vibration_m_s2) = (0.5, 3.0);
    let loss = MeasurementDropouts { rate_hz: 0.1, mean_s: 2.0 };
    let gnss = GnssModel { rate_hz: 5.0, loss, ..GnssModel::DEFAULT };
    assert_eq!(read(changed), InstrumentSuite { imu: Some(imu), gnss: Some(gnss), ..InstrumentSuite::default() });
}

#[test]
fn instruments_and_faults_that_do_not_exist_are_refused() {
    let refused = |text: &str| example(text).unwrap_err().to_string();
    let imu = "[instruments]\nimu = \"bmi270\"\n";
    let parts = "\"icm-42688-p\", \"bmi270\" or \"mpu-6000\"";
    let known = "imu, tracker, gnss, barometer, magnetometer";
    let cases = [
        (
            "[instruments]\nimu = \"bmi160\"",
            format!("2: instruments.imu: \"bmi160\" is unknown; did you mean \"bmi270\"? It must be {parts}"),
        ),
        ("[instruments]\ncompass = \"ist8310\"", format!("2: instruments.compass: unknown key; known here: {known}")),
        (
            "[instruments]\ngnss = \"m10\"",
            "1: instruments.imu: missing; add an imu, since the other instruments have no effect without one".into(),
        ),
        (
            "[instruments.imu.gyro]\nscale = 0.2",
            "2: instruments.imu.gyro.scale: 0.2 is out of range: it must lie within 0 to 0.1".into(),
        ),
        (
            "[instruments.imu.gyro]\nbias = 0.2",
            "2: instruments.imu.gyro.bias: unknown key; did you mean bias_rad_s (radians per second)?".into(),
        ),
        (
            "[instruments.tracker]\npart = \"vicon\"",
            "2: instruments.tracker.part: \"vicon\" is unknown; it must be \"mocap-100\"".into(),
        ),
        (
            "[[instrument_fault]]\nfailure = \"imu-dead\"\nstart_s = 1",
            "2: instrument_fault.failure: the scenario has no imu that could fail; add it to [instruments]".into(),
        ),
        (
            &format!("{imu}[[instrument_fault]]\nfailure = \"imu-noisy\"\nrates_rad_s = 1\nstart_s = 1"),
            "3: instrument_fault.specific_force_m_s2: missing; add it (metres per second squared)".into(),
        ),
        (
            &format!("{imu}[[instrument_fault]]\nfailure = \"imu-dead\"\nby_m = [1, 0, 0]\nstart_s = 1"),
            "5: instrument_fault.by_m: unknown key; known here: failure, start_s, duration_s, rise_s".into(),
        ),
        (
            &format!("{imu}[[instrument_fault]]\nfailure = \"imu-dead\"\nstart_s = 1\nrise_s = 2"),
            "6: instrument_fault.rise_s: the failure imu-dead has no size that could grow; leave rise_s out".into(),
        ),
        (
            "told = \"drawn\"",
            "1: told: the scenario has no instruments that [told] could describe; add [instruments], or leave [told] \
             out"
            .into(),
        ),
        (&format!("told = \"flown\"\n{imu}"), "1: told: \"flown\" is unknown; it must be \"drawn\"".into()),
        (
            &format!("{imu}[told]\ngnss = \"m10\""),
            "4: told.gnss: the scenario has no gnss that [told] could describe; add it to [instruments], or leave it \
             out of [told]"
                .into(),
        ),
        (&format!("{imu}[told]\nbaro = 1"), "4: told.baro: unknown key; did you mean barometer?".into()),
        (&format!("{imu}[tolt]\nimu = \"bmi270\""), "3: tolt: unknown key; did you mean told?".into()),
        (
            &format!("{imu}[told.imu.gyro]\nvibration = 1"),
            "4: told.imu.gyro.vibration: unknown key; did you mean vibration_rad_s (radians per second)?".into(),
        ),
    ];
    for (text, message) in cases {
        assert_eq!(refused(text), format!("example:{message}"));
    }
}

/// The IMU sits where the vehicle's file says: off the centre of mass it feels the centripetal acceleration.
#[test]
fn the_inertial_sensor_is_mounted_as_the_vehicle_says() {
    let scenario = |name: &str| {
        let text = format!("vehicle.name = \"{name}\"\n[instruments]\nimu = \"icm-42688-p\"\n");
        example(&text).unwrap()
    };
    let felt = |scenario: Scenario| {
        let still = scenario.plant(0.001).unwrap().truth();
        let turning = Truth { rates_rad_s: Vector3::x() * 10.0, ..still };
        let read = |truth| scenario.instruments(0.001).unwrap().unwrap().measure(truth).imu.unwrap();
        read(&turning).specific_force_m_s2.z - read(&still).specific_force_m_s2.z
    };
    // The IMU is 20 mm above the centre of mass and feels -omega^2 r, within scale error, misalignment and output step.
    assert!((felt(scenario("iris")) + 100.0 * 0.02).abs() < 0.03);
    assert!(felt(scenario("paper")).abs() < 0.01);
    assert!(example("").unwrap().instruments(0.001).unwrap().is_none());
}

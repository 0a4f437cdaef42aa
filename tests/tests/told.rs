//! Tests of `[told]`, the estimator's knowledge of the instruments, as opposed to their behaviour.
#![allow(clippy::unwrap_used, missing_docs)] // tests

use afbc::Profile;
use afbc_plant::InstrumentSuite;
use afbc_plant::instruments::{BarometerModel, ImuModel, MagnetometerModel, TrackerModel};
use afbc_scenario::contender::{Contender, ControllerKind};
use afbc_scenario::{AssumedInstruments, Scenario, parse};
use afbc_sim::flight::fly;

const INSTRUMENTS: &str = "[instruments]\ntracker = \"mocap-100\"\nbarometer = \"dps310\"\nmagnetometer = \"ist8310\"\n\
                           [instruments.imu]\npart = \"icm-42688-p\"\ngyro = { vibration_rad_s = 0.02 }\n\
                           accel = { vibration_m_s2 = 1.0 }\n";

fn scenario(text: &str) -> Scenario {
    let hover = "duration_s = 1.0\ncontrollers = [\"afbc\"]\nseed = 4\ndrag = {}\n\
                 trajectory = { kind = \"circle\", centre_m = [0, 0, 2], radius_m = 1, acceleration_m_s2 = 2 }\n";
    parse("example", &format!("{hover}{text}"), "example").unwrap()
}

/// Returns every bit of the motion and of the estimate.
fn bits(scenario: &Scenario) -> Vec<u64> {
    let mut bits = Vec::new();
    let contender = Contender::of(ControllerKind::Afbc, Profile::Flight);
    let lost = fly(scenario, &contender, |sample| {
        let estimated = sample.estimated.unwrap();
        let motion = sample.motion.position_m.iter().chain(&sample.motion.attitude_rad).copied();
        let errors = estimated.position_error_m.iter().chain(&estimated.attitude_sigma_rad).copied();
        bits.extend(motion.chain(errors.map(f64::from)).map(f64::to_bits));
    });
    assert_eq!(lost.unwrap(), None);
    bits
}

/// If `[told]` states the instruments as they are, in any form, a flight has the same bits as without the table. With
/// other values it has other bits.
#[test]
fn told_what_the_instruments_say_a_flight_is_the_same_in_every_bit() {
    let plain = bits(&scenario(INSTRUMENTS));
    let same = INSTRUMENTS.replace("[instruments", "[told");
    for told in [same.as_str(), "[told]\n", "[told]\nimu = {}\n", "[told]\nbarometer = \"dps310\"\n"] {
        assert!(bits(&scenario(&format!("{INSTRUMENTS}{told}"))) == plain, "{told}");
    }
    assert!(bits(&scenario(&format!("told = \"drawn\"\n{INSTRUMENTS}"))) == plain);
    for other in [
        "[told]\nimu = { gyro = { vibration_rad_s = 0.2 } }\n",
        "[told]\ntracker = { position_m = 0.01 }\n",
        "[told]\nbarometer = \"bmp388\"\n",
        "[told]\nmagnetometer = { hard_iron_ut = 10.0 }\n",
    ] {
        assert!(bits(&scenario(&format!("{INSTRUMENTS}{other}"))) != plain, "{other}");
    }
}

/// `[told]` overrides the file's instruments key by key.
#[test]
fn what_is_told_is_read_key_by_key() {
    let told =
        "[told.magnetometer]\nhard_iron_ut = 10.0\n[told.imu]\npart = \"bmi270\"\n[told.tracker]\nrate_hz = 50\n";
    let scenario = scenario(&format!("{INSTRUMENTS}{told}"));
    let there = scenario.instruments;
    let wanted = InstrumentSuite {
        imu: Some(ImuModel::BMI270),
        tracker: Some(TrackerModel { rate_hz: 50.0, ..TrackerModel::MOCAP_100 }),
        magnetometer: Some(MagnetometerModel { hard_iron_ut: 10.0, ..MagnetometerModel::IST8310 }),
        ..there
    };
    assert_eq!((scenario.told.clone(), scenario.told()), (AssumedInstruments::Suite(Box::new(wanted)), wanted));
    assert_eq!(there.barometer, Some(BarometerModel::DPS310));
    // The told values stay when the instruments change. Nothing is told about an instrument that is gone.
    let mut drawn = scenario.clone();
    drawn.instruments = InstrumentSuite { imu: Some(ImuModel::MPU_6000), tracker: None, ..there };
    assert_eq!(drawn.told(), InstrumentSuite { tracker: None, ..wanted });
}

/// The estimator knows the part that a vehicle file names and the settings that it states. `[told]` takes precedence.
#[test]
fn a_vehicles_file_says_what_it_knows() {
    let plain = scenario(INSTRUMENTS);
    let file = afbc_vehicles::built_in("iris").unwrap();
    let on = |text: &str, scenario: &Scenario| {
        let vehicle = afbc_vehicles::parse("iris.toml", text, "iris").unwrap();
        scenario.clone().on(&vehicle, Profile::Flight).unwrap()
    };
    let part = file.text.replace("[imu]\n", "[imu]\npart = \"mpu-6000\"\n");
    let set = format!("{}\n[estimator]\ngate_sigmas = 4.0\ngyro_noise_rad_s_rthz = 0.01\n", file.text);
    let settings = |scenario: &Scenario| scenario.estimation(0.001);
    let bare = on(file.text, &plain);
    assert_eq!(bare.told(), plain.instruments);
    let named = on(&part, &plain);
    assert_eq!(named.told(), InstrumentSuite { imu: Some(ImuModel::MPU_6000), ..plain.instruments });
    assert_eq!(named.instruments, plain.instruments);
    assert_ne!(settings(&named), settings(&bare));
    let stated = settings(&on(&set, &plain));
    let mut wanted = settings(&bare);
    (wanted.gate_sigmas, wanted.gyro_noise_rad_s_rthz) = (4.0, 0.01);
    assert_eq!(stated, wanted);
    let told = scenario(&format!("{INSTRUMENTS}[told]\nimu = \"bmi270\"\n"));
    assert_eq!(on(&part, &told).told().imu, Some(ImuModel::BMI270));
}

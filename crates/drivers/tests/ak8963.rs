//! MPU-9250 with AK8963, tested on models of their registers.

use crate::rig::mpu_registers::{Magnetometer, Registers};
use crate::rig::suite::{Pace, Suite};
use crate::rig::{Rig, reads, run};
use afbc_drivers::PartFault;
use afbc_drivers::ak8963::{Mpu9250Ak8963, Mpu9250Reading};
use nalgebra::Vector3;

/// Field along the IMU's axes.
const FIELD_UT: [f64; 3] = [20.0, -7.0, 44.0];

/// Returns the same vector along the magnetometer's axes, as drawn in the product specification.
fn turned([x, y, z]: [f64; 3]) -> [f64; 3] {
    [y, x, -z]
}

fn both() -> Registers {
    let mut part = Registers::new(0x71);
    part.magnetometer = Some(Magnetometer::new(turned(FIELD_UT)));
    part
}

fn is_right_of_imu(reading: &Mpu9250Reading) -> bool {
    reads(&reading.inertial, [10.0, -250.0, 0.5], [0.1, -0.2, 1.0], 31.0)
}

fn is_near(reading: &Mpu9250Reading, field_ut: [f64; 3], error_ut: f32) -> bool {
    let field = Vector3::from(field_ut).map(|field| field as f32);
    reading.magnetic.is_ok_and(|new| new.is_none_or(|new| (new.field_ut - field).amax() < error_ut))
}

fn right(reading: &Mpu9250Reading) -> bool {
    is_right_of_imu(reading) && is_near(reading, FIELD_UT, 1.0)
}

fn news(readings: &[afbc_types::Stamped<Mpu9250Reading>]) -> usize {
    readings.iter().filter(|reading| reading.value.magnetic.is_ok_and(|new| new.is_some())).count()
}

#[test]
fn it_passes_the_suite() {
    let (others, pace) = (vec![(Registers::new(0x70), 0x70)], Pace::Interrupts(1_000, 600));
    Suite { part: &Mpu9250Ak8963::default, model: &both, right, notice_us: 60_000, others, pace }.passes();
}

#[test]
fn the_field_is_measured_100_times_a_second_beside_1000_readings() {
    for takes_us in [6_000, 7_200, 9_000] {
        let rig = Rig::new(both());
        rig.with(|part| part.magnetometer.as_mut().expect("one").takes_us = takes_us);
        let mut driver = rig.driver(Mpu9250Ak8963::default());
        let _ = run(&mut driver, &rig, 500_000);
        let (readings, faults) = run(&mut driver, &rig, 1_000_000);
        assert!(faults.is_empty() && readings.len().abs_diff(1_000) < 3, "{} {faults:?}", readings.len());
        assert!(news(&readings).abs_diff(100) < 4, "{}", news(&readings));
    }
}

#[test]
fn its_full_range_is_read_whatever_its_sensitivity() {
    for adjustment in [[0x01, 0x80, 0xFE], [0xB0, 0x6C, 0xA4]] {
        let rig = Rig::new(both());
        rig.with(|part| part.magnetometer.as_mut().expect("one").adjustment = adjustment);
        let mut driver = rig.driver(Mpu9250Ak8963::default());
        for field in [[0.0; 3], [2000.0, 1500.0, -1400.0], [-1400.0, -1500.0, 2000.0], [4.0, 4800.0, -3.0]] {
            // Half the sensitivity means half the range.
            let field = if adjustment[0] == 1 { field.map(|field| field / 2.0) } else { field };
            rig.with(|part| part.magnetometer.as_mut().expect("one").field_ut = turned(field));
            let _ = run(&mut driver, &rig, 500_000);
            let (readings, _) = run(&mut driver, &rig, 200_000);
            assert!(news(&readings) > 15 && readings.iter().all(|reading| is_near(&reading.value, field, 1.0)));
        }
        rig.with(|part| part.magnetometer.as_mut().expect("one").field_ut = [2000.0, 2000.0, 1000.0]);
        let _ = run(&mut driver, &rig, 50_000);
        let (readings, faults) = run(&mut driver, &rig, 200_000);
        let ranges = readings.iter().filter(|reading| reading.value.magnetic == Err(PartFault::Range)).count();
        assert!(faults.is_empty() && ranges > 15 && news(&readings) == 0, "{ranges}");
    }
}

#[test]
fn a_magnetometer_that_is_no_more_costs_no_reading_of_the_imu() {
    let rig = Rig::new(both());
    let mut driver = rig.driver(Mpu9250Ak8963::default());
    let _ = run(&mut driver, &rig, 500_000);
    rig.with(|part| part.magnetometer.as_mut().expect("one").answers = false);
    let (readings, faults) = run(&mut driver, &rig, 200_000);
    assert!(
        faults.is_empty() && readings.len() >= 198 && readings.iter().all(|reading| is_right_of_imu(&reading.value))
    );
    let late = readings.iter().position(|reading| reading.value.magnetic == Err(PartFault::Late)).expect("late");
    assert!((80..=120).contains(&late), "{late}");
    rig.with(|part| part.magnetometer.as_mut().expect("one").answers = true);
    let _ = run(&mut driver, &rig, 50_000);
    let (readings, faults) = run(&mut driver, &rig, 200_000);
    assert!(faults.is_empty() && readings.iter().all(|reading| right(&reading.value)) && news(&readings) > 15);
}

#[test]
fn a_magnetometer_that_was_reset_goes_on() {
    let rig = Rig::new(both());
    let mut driver = rig.driver(Mpu9250Ak8963::default());
    let _ = run(&mut driver, &rig, 500_000);
    for _ in 0..20 {
        rig.with(|part| part.magnetometer.as_mut().expect("one").reset());
        let (readings, faults) = run(&mut driver, &rig, 53_000);
        assert!(faults.is_empty() && readings.iter().all(|reading| right(&reading.value)) && news(&readings) >= 3);
    }
}

#[test]
fn a_magnetometer_that_is_missing_another_one_or_damaged_is_told() {
    let is = |change: &dyn Fn(&mut Registers), fault: PartFault| {
        let rig = Rig::new(both());
        rig.with(|part| change(part));
        let mut driver = rig.driver(Mpu9250Ak8963::default());
        let (readings, faults) = run(&mut driver, &rig, 1_000_000);
        assert!(faults.is_empty() && readings.len() > 600, "{faults:?}");
        assert!(readings.iter().all(|reading| is_right_of_imu(&reading.value) && reading.value.magnetic == Err(fault)));
    };
    is(&|part| part.magnetometer = None, PartFault::Silent);
    is(&|part| part.magnetometer.as_mut().expect("one").answers = false, PartFault::Silent);
    is(&|part| part.magnetometer.as_mut().expect("one").identity = 0x09, PartFault::Identity(0x09));
    is(&|part| part.magnetometer.as_mut().expect("one").adjustment = [0x80, 0xFF, 0x80], PartFault::Calibration);
    is(&|part| part.magnetometer.as_mut().expect("one").adjustment = [0x80, 0x80, 0x00], PartFault::Calibration);
}

//! The MPU-6000 family, tested on a model of their registers.

use crate::rig::mpu_registers::Registers;
use crate::rig::suite::{Pace, Suite, reads_the_whole_range};
use crate::rig::{Rig, reads, run};
use afbc_drivers::mpu::{Icm20602, Icm20608, Icm20689, Mpu, Mpu6000, Mpu6500, Mpu9250};
use afbc_drivers::{InertialReading, PartFault, ScriptStep, SensorPart};
use embassy_futures::block_on;

fn right(reading: &InertialReading) -> bool {
    reads(reading, [10.0, -250.0, 0.5], [0.1, -0.2, 1.0], 31.0)
}

fn is_right<const IDENTITY: u8>() {
    let (part, model) = (&|| Mpu::<IDENTITY> {}, &|| Registers::new(IDENTITY));
    let (other, pace) = (IDENTITY ^ 0x55, Pace::Interrupts(1_000, 600));
    let others = vec![(Registers::new(other), other)];
    Suite { part, model, right, notice_us: 60_000, others, pace }.passes();
    let set = |part: &mut Registers, rates, force, temperature_c| {
        (part.rates_deg_s, part.force_g, part.temperature_c) = (rates, force, temperature_c);
    };
    reads_the_whole_range(part(), model(), set, ([-39.0, 85.0, 25.0, 0.0], 0.01));

    let rig = Rig::new(model());
    let _ = run(&mut rig.driver(part()), &rig, 1_000_000);
    assert!(rig.with(|part| part.is_i2c_off), "{}", Mpu::<IDENTITY>::NAME);
}

#[test]
fn mpu_6000() {
    is_right::<0x68>();
    assert_eq!((Mpu6000::NAME, Mpu6000::SPI.map(|spi| spi.clock_hz)), ("MPU-6000", Some(1_000_000)));
}

#[test]
fn mpu_6500() {
    is_right::<0x70>();
    assert_eq!((Mpu6500::NAME, Mpu6500::SPI.map(|spi| spi.clock_hz)), ("MPU-6500", Some(1_000_000)));
}

#[test]
fn mpu_9250() {
    is_right::<0x71>();
    assert_eq!((Mpu9250::NAME, Mpu9250::SPI.map(|spi| spi.clock_hz)), ("MPU-9250", Some(1_000_000)));
}

#[test]
fn icm_20602() {
    is_right::<0x12>();
    assert_eq!((Icm20602::NAME, Icm20602::SPI.map(|spi| spi.clock_hz)), ("ICM-20602", Some(10_000_000)));
}

#[test]
fn icm_20608() {
    is_right::<0xAF>();
    assert_eq!((Icm20608::NAME, Icm20608::SPI.map(|spi| spi.clock_hz)), ("ICM-20608-G", Some(8_000_000)));
}

#[test]
fn icm_20689() {
    is_right::<0x98>();
    assert_eq!((Icm20689::NAME, Icm20689::SPI.map(|spi| spi.clock_hz)), ("ICM-20689", Some(8_000_000)));
}

fn tested<P: SensorPart>(part: P, identity: u8, trims: [[u8; 4]; 2], responses: [f64; 6]) -> Result<(), PartFault> {
    let rig = Rig::new(Registers::new(identity));
    rig.with(|part| (part.trims, part.responses, part.rates_deg_s) = (trims, responses, [1.0, -19.0, 0.5]));
    let mut driver = rig.driver(part);
    let result = block_on(driver.self_test());
    let (readings, faults) = run(&mut driver, &rig, 500_000);
    assert!(faults.is_empty() && readings.len() > 100, "it reads on: {faults:?}");
    result
}

/// The responses are powers of a factor times 25 deg/s and 0.34 g, and the rate about y is negative (RM-MPU-6000A).
#[test]
fn the_self_test_of_the_mpu_6000_passes_within_14_percent() {
    // Codes: XG 17, YG 1, ZG 31; XA 22 = 0b10110, YA 9 = 0b01001, ZA 31.
    let trims = [[0; 4], [0b101 << 5 | 17, 0b010 << 5 | 1, 0b111 << 5 | 31, 0b10 << 4 | 0b01 << 2 | 0b11]];
    let force = |number: i32| 0.34 * (0.92_f64 / 0.34).powf(f64::from(number - 1) / 30.0);
    let expected = [25.0 * 1.046_f64.powi(16), -25.0, 25.0 * 1.046_f64.powi(30), force(22), force(9), force(31)];
    let with = |axis: usize, factor: f64| {
        let mut responses = expected;
        responses[axis] *= factor;
        tested(Mpu6000 {}, 0x68, trims, responses)
    };
    for axis in 0..6 {
        for (factor, passes) in [(1.0, true), (0.87, true), (1.13, true), (0.85, false), (1.15, false), (0.0, false)] {
            let result = with(axis, factor);
            assert_eq!(result, if passes { Ok(()) } else { Err(PartFault::SelfTest) }, "{axis}: {factor}");
        }
    }
}

/// AN-MPU-9250A-03: a rate responds by more than half of the factory's response, a force by 0.5 to 1.5 of it. Without a
/// factory response, a rate needs 60 deg/s and a force 0.225 to 0.675 g.
#[test]
fn the_self_test_of_the_mpu_6500_and_mpu_9250_passes_as_at_the_factory() {
    let number = |trim: i32| 2620.0 * 1.01_f64.powi(trim - 1);
    let trims = [[150, 99, 200, 0], [60, 1, 120, 0]];
    let [x, y, z] = [150, 99, 200].map(|trim| number(trim) / 131.0);
    let [fx, fy, fz] = [60, 1, 120].map(|trim| number(trim) / 16384.0);
    let expected = [x, y, z, fx, fy, fz];
    for axis in 0..6 {
        for (factor, passes) in [(1.0, true), (0.55, true), (0.45, false), (1.45, true), (1.55, axis < 3), (0.0, false)]
        {
            let mut responses = expected;
            responses[axis] *= factor;
            let result = tested(Mpu9250 {}, 0x71, trims, responses);
            assert_eq!(result, if passes { Ok(()) } else { Err(PartFault::SelfTest) }, "{axis}: {factor}");
        }
    }
    for (rate, force, passes) in
        [(62.0, 0.23, true), (58.0, 0.5, false), (62.0, 0.22, false), (62.0, 0.68, false), (-90.0, -0.67, true)]
    {
        let responses = [rate, rate, rate, force, force, force];
        let result = tested(Mpu6500 {}, 0x70, [[0; 4]; 2], responses);
        assert_eq!(result, if passes { Ok(()) } else { Err(PartFault::SelfTest) }, "{rate}, {force}");
    }
}

/// After its own reset, an MPU needs one of its signal paths (register 0x68), by its register map. An ICM does not.
#[test]
fn an_mpu_also_resets_its_signal_paths() {
    let resets = |setup: &[ScriptStep]| setup.iter().any(|step| matches!(step, ScriptStep::Write(0x68, 0b111)));
    assert!([Mpu6000::SETUP, Mpu6500::SETUP, Mpu9250::SETUP].into_iter().all(resets));
    assert!(![Icm20602::SETUP, Icm20608::SETUP, Icm20689::SETUP].into_iter().any(resets));
}

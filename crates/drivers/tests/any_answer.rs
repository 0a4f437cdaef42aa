//! For any register content and any answer of an IMU, its driver does not panic and reads nothing beyond the part's
//! range.

use crate::rig::{Model, Rig, run};
use afbc_drivers::ak8963::Mpu9250Ak8963;
use afbc_drivers::bmi270::Bmi270;
use afbc_drivers::icm426xx::{Icm42605, Icm42688p};
use afbc_drivers::mpu::{Icm20602, Icm20608, Icm20689, Mpu6000, Mpu6500, Mpu9250};
use afbc_drivers::{InertialReading, PartFault, READ_MAX, ScriptStep, SensorPart};
use proptest::prelude::*;

/// A part that passes its set-up; all its other registers hold random bytes.
struct Anything {
    registers: Vec<Option<u8>>,
    is_kept: Vec<bool>,
    bytes: Vec<u8>,
    at: usize,
}

impl Anything {
    fn new<P: SensorPart>(bytes: &[u8]) -> Self {
        let (mut registers, mut is_kept) = (vec![None; 256], vec![false; 256]);
        for step in P::SETUP {
            match *step {
                ScriptStep::Identify(register, identities) => {
                    registers[usize::from(register)] = identities.first().copied()
                }
                ScriptStep::Await(register, mask, value, _) if mask != 0 => {
                    registers[usize::from(register)] = Some(value)
                }
                ScriptStep::Set(register, _) => is_kept[usize::from(register)] = true,
                _ => (),
            }
        }
        Anything { registers, is_kept, bytes: bytes.to_vec(), at: 0 }
    }
}

impl Model for Anything {
    fn read(&mut self, _: u64, register: u8, into: &mut [u8]) {
        for (register, byte) in (usize::from(register)..).zip(into) {
            self.at += 1;
            let any = self.bytes[self.at % self.bytes.len()].wrapping_add((self.at / self.bytes.len()) as u8);
            *byte = self.registers.get(register).copied().flatten().unwrap_or(any);
        }
    }

    fn write(&mut self, _: u64, register: u8, bytes: &[u8]) {
        if let &[byte] = bytes
            && self.is_kept[usize::from(register)]
        {
            self.registers[usize::from(register)] = Some(byte);
        }
    }

    fn reset(&mut self, _: u64) {}

    fn next_interrupt_us(&self, now_us: u64) -> Option<u64> {
        Some(now_us + 500)
    }
}

/// Checks the ranges that all these parts share.
fn check(reading: &InertialReading, name: &str) -> Result<(), TestCaseError> {
    let InertialReading { rates_rad_s, specific_force_m_s2, temperature_c } = reading;
    prop_assert!(rates_rad_s.iter().all(|rate| rate.abs() <= 2000.01_f32.to_radians()), "{name}: {rates_rad_s}");
    prop_assert!(specific_force_m_s2.iter().all(|force| force.abs() <= 16.001 * 9.80665), "{name}");
    prop_assert!((-300.0..300.0).contains(temperature_c), "{name}: {temperature_c}");
    Ok(())
}

fn survives<P: SensorPart + Default>(
    bytes: &[u8],
    check: impl Fn(&P::Reading) -> Result<(), TestCaseError>,
) -> Result<(), TestCaseError> {
    // Answers of any register and length.
    let mut part = P::default();
    for (at, length) in bytes.iter().zip(bytes.iter().skip(1)) {
        let answer: Vec<u8> =
            bytes.iter().cycle().skip(usize::from(*at)).take(usize::from(*length) % 40).copied().collect();
        if let Ok(Some(reading)) = part.take(*at, &answer) {
            check(&reading)?;
        }
    }
    // Answers to the reads of the scripts.
    for step in P::SETUP.iter().chain(P::CYCLE).chain(P::CYCLE) {
        if let ScriptStep::Read(register, length) = *step {
            prop_assert!(length <= READ_MAX);
            let answer: Vec<u8> = bytes.iter().cycle().skip(usize::from(register)).take(length).copied().collect();
            if let Ok(Some(reading)) = part.take(register, &answer) {
                check(&reading)?;
            }
        }
    }
    // Random registers, read by the driver.
    let rig = Rig::new(Anything::new::<P>(bytes));
    let mut driver = rig.driver(P::default());
    let (readings, faults) = run(&mut driver, &rig, 500_000);
    prop_assert!(!faults.contains(&PartFault::Bus), "{}: {faults:?}", P::NAME);
    readings.iter().try_for_each(|reading| check(&reading.value))
}

fn survives_inertial<P: SensorPart<Reading = InertialReading> + Default>(bytes: &[u8]) -> Result<(), TestCaseError> {
    survives::<P>(bytes, |reading| check(reading, P::NAME))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_answer_of_an_imu_is_within_its_range(bytes in prop::collection::vec(any::<u8>(), 1..300)) {
        survives_inertial::<Icm42688p>(&bytes)?;
        survives_inertial::<Icm42605>(&bytes)?;
        survives_inertial::<Bmi270>(&bytes)?;
        survives_inertial::<Mpu6000>(&bytes)?;
        survives_inertial::<Mpu6500>(&bytes)?;
        survives_inertial::<Mpu9250>(&bytes)?;
        survives_inertial::<Icm20602>(&bytes)?;
        survives_inertial::<Icm20608>(&bytes)?;
        survives_inertial::<Icm20689>(&bytes)?;
        survives::<Mpu9250Ak8963>(&bytes, |reading| {
            check(&reading.inertial, Mpu9250Ak8963::NAME)?;
            if let Ok(Some(magnetic)) = reading.magnetic {
                // The range is +-4914 uT, times the largest sensitivity factor.
                prop_assert!(magnetic.field_ut.amax() <= 4914.1 * 1.5, "{}", magnetic.field_ut);
            }
            Ok(())
        })?;
    }

    #[test]
    fn extreme_answers_are_within_its_range(
        bytes in prop::collection::vec(prop::sample::select(vec![0x00, 0x01, 0x48, 0x7F, 0x80, 0xFF]), 1..300)
    ) {
        survives_inertial::<Icm42688p>(&bytes)?;
        survives_inertial::<Bmi270>(&bytes)?;
        survives_inertial::<Mpu6000>(&bytes)?;
        survives::<Mpu9250Ak8963>(&bytes, |reading| check(&reading.inertial, Mpu9250Ak8963::NAME))?;
    }
}

#[test]
fn a_part_that_passes_its_set_up_is_read() {
    // Makes sure that the properties above are tested with readings at all.
    fn readings<P: SensorPart + Default>() -> usize {
        let bytes: Vec<u8> = (0..251_u32).map(|at| (at * at * 37 + 11) as u8).collect();
        let rig = Rig::new(Anything::new::<P>(&bytes));
        run(&mut rig.driver(P::default()), &rig, 1_000_000).0.len()
    }
    for (at, count) in [
        readings::<Icm42688p>(),
        readings::<Bmi270>(),
        readings::<Mpu6000>(),
        readings::<Icm20602>(),
        readings::<Mpu9250Ak8963>(),
    ]
    .into_iter()
    .enumerate()
    {
        assert!(count > 500, "{at}: {count}");
    }
}

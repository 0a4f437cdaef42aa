//! BMI270, tested on a model of its registers (BST-BMI270-DS000).

use crate::bmi270_model::Bmi270Registers;
use crate::rig::suite::{Pace, Suite, reads_the_whole_range};
use crate::rig::{Model, Rig, noise, reads, run};
use afbc_drivers::bmi270::Bmi270;
use afbc_drivers::{InertialReading, PartFault, Registers as _, ScriptStep, SensorPart, SpiRegisters};
use embassy_futures::block_on;
use embedded_hal_async::spi::{ErrorType, Operation, SpiDevice};

impl Model for Bmi270Registers {
    fn read(&mut self, now_us: u64, register: u8, into: &mut [u8]) {
        self.read(now_us, register, into);
    }

    fn write(&mut self, now_us: u64, register: u8, bytes: &[u8]) {
        self.write(now_us, register, bytes);
    }

    fn reset(&mut self, now_us: u64) {
        self.reset(now_us);
    }

    fn next_interrupt_us(&self, now_us: u64) -> Option<u64> {
        self.next_interrupt_us(now_us)
    }
}

fn part(identity: u8) -> Bmi270Registers {
    Bmi270Registers::new(identity, noise)
}

/// The data sheet's minimum differences are 16, -15 and 10 g.
#[test]
fn its_self_test_passes_when_it_is_pushed_far_enough() {
    for (pushes_g, passes) in [
        ([8.1, -7.6, 5.1], true),
        ([7.9, -7.6, 5.1], false),
        ([8.1, -7.4, 5.1], false),
        ([8.1, -7.6, 4.9], false),
        ([8.1, 7.6, 5.1], false),
        ([0.0; 3], false),
    ] {
        let rig = Rig::new(part(0x24));
        rig.with(|part| part.pushes_g = pushes_g);
        let mut driver = rig.driver(Bmi270::default());
        let result = block_on(driver.self_test());
        assert_eq!(result, if passes { Ok(()) } else { Err(PartFault::SelfTest) }, "{pushes_g:?}");
        let (readings, faults) = run(&mut driver, &rig, 300_000);
        assert!(faults.is_empty() && readings.len() > 200 && readings.iter().all(|reading| right(&reading.value)));
    }
}

fn right(reading: &InertialReading) -> bool {
    reads(reading, [10.0, -250.0, 500.0], [0.1, -0.2, 1.0], 31.0)
}

#[test]
fn it_passes_the_suite() {
    let (others, pace) = (vec![(part(0x43), 0x43)], Pace::Interrupts(625, 1_400));
    Suite { part: &Bmi270::default, model: &|| part(0x24), right, notice_us: 60_000, others, pace }.passes();
    let mut model = part(0x24);
    model.cas = 0;
    let set = |part: &mut Bmi270Registers, rates, force, temperature_c| {
        (part.rates_deg_s, part.force_g, part.temperature_c) = (rates, force, temperature_c);
    };
    reads_the_whole_range(Bmi270::default(), model, set, ([-40.0, 85.0, 23.0, 23.0], 0.01));
}

#[test]
fn a_wrong_crosstalk_of_the_gyroscope_is_corrected() {
    for cas in [-64, -1, 0, 3, 63] {
        let rig = Rig::new(part(0x24));
        rig.with(|part| part.cas = cas);
        let (readings, faults) = run(&mut rig.driver(Bmi270::default()), &rig, 500_000);
        assert!(faults.is_empty() && readings.iter().all(|reading| right(&reading.value)), "{cas}");
    }
}

#[test]
fn a_part_whose_configuration_is_lost_is_late() {
    // All registers that are read back are intact, but the part does not work.
    let rig = Rig::new(part(0x24));
    let mut driver = rig.driver(Bmi270::default());
    let _ = run(&mut driver, &rig, 500_000);
    rig.with(|part| part.started_us = Some((0, false)));
    let (readings, faults) = run(&mut driver, &rig, 5_000);
    assert!(readings.is_empty() && faults.contains(&PartFault::Late), "{faults:?}");
}

/// Bytes sent to the device in the last transfer.
struct Sent(Vec<u8>);

impl ErrorType for Sent {
    type Error = core::convert::Infallible;
}

impl SpiDevice for Sent {
    async fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Self::Error> {
        self.0.clear();
        for operation in operations {
            match operation {
                Operation::TransferInPlace(bytes) => {
                    self.0.extend_from_slice(bytes);
                    bytes.iter_mut().zip(0..).for_each(|(byte, at)| *byte = at);
                }
                _ => panic!("not what a read is"),
            }
        }
        Ok(())
    }
}

#[test]
fn a_byte_is_skipped_in_front_of_its_answers_and_the_configuration_is_one_block() {
    let spi = Bmi270::SPI.expect("SPI");
    let mut byte = [0];
    block_on(SpiRegisters::new(Sent(Vec::new()), spi).read(0x00, &mut byte)).expect("a read");
    assert_eq!(byte, [2], "command and dummy are sent before it is read");
    let blocks =
        Bmi270::SETUP.iter().filter(|step| matches!(step, ScriptStep::WriteAll(0x5E, bytes) if bytes.len() == 8192));
    assert_eq!(blocks.count(), 1);
}

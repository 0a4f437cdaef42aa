//! BMI270 on SPI: the register model of the driver's tests, and the SPI protocol around it.

#[allow(dead_code, reason = "shared with the driver's tests, which use all of it")]
#[path = "../../../crates/drivers/tests/bmi270_model/mod.rs"]
mod bmi270_model;

use bmi270_model::Bmi270Registers;
use rigless::chip::Timeline;
use rigless::chip::spi::Peer;
use rigless::snapshot::{Error, Reader, Store, Writer};

/// Value of the register CHIP_ID.
const IDENTITY: u8 = 0x24;
/// Number of registers.
const REGISTERS: usize = 128;
/// Bit of the first byte that requests a read. The data begin after one dummy byte (data sheet, section on interfaces,
/// 5.2).
const READS: u8 = 0x80;

/// Phase of a transfer.
#[derive(Debug, Default)]
enum SpiPhase {
    #[default]
    Idle,
    Address,
    Dummy(u8),
    /// Data being read, and index of the next byte.
    Reads(Vec<u8>, usize),
    /// First register being written, and the data so far.
    Writes(u8, Vec<u8>),
}

/// BMI270 on SPI.
#[derive(Debug)]
pub struct Bmi270Model {
    registers: Bmi270Registers,
    phase: SpiPhase,
}

impl Bmi270Model {
    pub fn new() -> Self {
        // No noise of its own: the plant's readings already have noise.
        let mut registers = Bmi270Registers::new(IDENTITY, |_, _| 0.0);
        registers.rates_deg_s = [0.0; 3];
        registers.force_g = [0.0, 0.0, 1.0];
        Bmi270Model { registers, phase: SpiPhase::Idle }
    }

    /// Sets the measured rates [mdeg/s], specific force [1e-6 g] and temperature [0.01 degrees C], in the sensor's
    /// axes.
    pub fn set_motion(&mut self, rate: [i32; 3], force: [i32; 3], temperature: i32) {
        self.registers.rates_deg_s = rate.map(|rate| f64::from(rate) * 1e-3);
        self.registers.force_g = force.map(|force| f64::from(force) * 1e-6);
        self.registers.temperature_c = f64::from(temperature) * 1e-2;
    }
}

impl Peer for Bmi270Model {
    fn transfer(&mut self, mosi: u32, _: u8, context: &mut Timeline<'_, '_>) -> u32 {
        let now_us = context.now().0 / 1000;
        let byte = mosi as u8;
        let (phase, answer) = match std::mem::take(&mut self.phase) {
            SpiPhase::Idle => (SpiPhase::Idle, 0xFF),
            SpiPhase::Address if byte & READS != 0 => (SpiPhase::Dummy(byte & !READS), 0),
            SpiPhase::Address => (SpiPhase::Writes(byte, Vec::new()), 0),
            SpiPhase::Dummy(register) => {
                let mut bytes = vec![0; REGISTERS - usize::from(register)];
                self.registers.read(now_us, register, &mut bytes);
                (SpiPhase::Reads(bytes, 0), 0)
            }
            SpiPhase::Reads(bytes, at) => {
                let answer = bytes.get(at).copied().unwrap_or_default();
                (SpiPhase::Reads(bytes, at + 1), answer)
            }
            SpiPhase::Writes(register, mut bytes) => {
                bytes.push(byte);
                (SpiPhase::Writes(register, bytes), 0)
            }
        };
        self.phase = phase;
        answer.into()
    }

    fn select(&mut self, _: &mut Timeline<'_, '_>) {
        self.phase = SpiPhase::Address;
    }

    fn deselect(&mut self, context: &mut Timeline<'_, '_>) {
        if let SpiPhase::Writes(register, bytes) = std::mem::take(&mut self.phase) {
            self.registers.write(context.now().0 / 1000, register, &bytes);
        }
    }
}

/// Snapshots are taken between transfers, so the transfer's phase is not stored.
impl Store for Bmi270Model {
    fn store(&self, to: &mut Writer) -> Result<(), Error> {
        let Bmi270Registers { registers, is_spi, reset_us, awake_us, loaded, started_us, on_us, .. } = &self.registers;
        to.put(&(registers.to_vec(), is_spi, reset_us, awake_us, loaded, started_us, on_us))
    }

    fn load(&mut self, from: &mut Reader) -> Result<(), Error> {
        let part = &mut self.registers;
        let values: Vec<u8>;
        (values, part.is_spi, part.reset_us, part.awake_us, part.loaded, part.started_us, part.on_us) = from.take()?;
        part.registers.iter_mut().zip(values).for_each(|(register, value)| *register = value);
        Ok(())
    }
}

//! QST QMC5883L, over I2C (data sheet 1.0).
//!
//! +-8 gauss (800 uT) at 100 Hz, each the mean of 512 samples, the narrowest of the part's filters. The set/reset
//! period is the one that the data sheet recommends. The data-ready flag is polled; the pin DRDY is not used. A field
//! beyond the range is a fault ([`PartFault::Range`]); beyond 10.9 gauss the part itself flags an overflow.

use crate::bus::SpiFormat;
use crate::part::{PartFault, ScriptStep, SensorPart};
use crate::reading::{MagneticReading, little};

/// QMC5883L.
#[derive(Clone, Copy, Debug, Default)]
pub struct Qmc5883l;

// Registers; the data sheet only numbers them.
const DATA_OUTPUT_X_LSB: u8 = 0x00;
const STATUS: u8 = 0x06;
const CONTROL_1: u8 = 0x09;
const CONTROL_2: u8 = 0x0A;
const SET_RESET_PERIOD: u8 = 0x0B;
const CHIP_ID: u8 = 0x0D;

const DRDY: u8 = 0x01;
const OVL: u8 = 0x02;
const SOFT_RST: u8 = 0x80;
const UT_PER_LSB: f32 = 100.0 / 3000.0;
const RANGE_UT: f32 = 800.0;

impl SensorPart for Qmc5883l {
    type Reading = MagneticReading;
    const NAME: &'static str = "QMC5883L";
    const SPI: Option<SpiFormat> = None;
    const I2C: &'static [u8] = &[0x0D];
    const STUCK_AFTER: u32 = 20;
    const SETUP: &'static [ScriptStep] = &[
        ScriptStep::Write(CONTROL_2, SOFT_RST),
        ScriptStep::Wait(1_000),
        // A missing part reads 0xFF, too; the rest of the set-up tells them apart.
        ScriptStep::Identify(CHIP_ID, &[0xFF]),
        ScriptStep::Set(SET_RESET_PERIOD, 0x01),
        ScriptStep::Set(CONTROL_1, 0b00_01_10_01), // 512 samples, 8 gauss, 100 Hz, continuous
    ];
    // Reads the data together with their flags.
    const CYCLE: &'static [ScriptStep] =
        &[ScriptStep::Wait(8_000), ScriptStep::Await(STATUS, DRDY, DRDY, 12), ScriptStep::Read(DATA_OUTPUT_X_LSB, 7)];

    fn take(&mut self, _: u8, answer: &[u8]) -> Result<Option<MagneticReading>, PartFault> {
        let &[ref data @ .., status] = answer else { return Err(PartFault::Bus) };
        let field_ut = little(data.try_into().map_err(|_| PartFault::Bus)?) * UT_PER_LSB;
        if status & OVL != 0 || field_ut.amax() > RANGE_UT {
            return Err(PartFault::Range);
        }
        Ok(Some(MagneticReading { field_ut }))
    }
}

//! ST LIS3MDL, over SPI or I2C (DS9463).
//!
//! +-4 gauss (400 uT) at 80 Hz in ultra-high-performance mode, which has the least noise. The data-ready flag is
//! polled; the pin DRDY and the temperature are not used. A field beyond the range is a fault ([`PartFault::Range`]).

use crate::bus::SpiFormat;
use crate::part::{PartFault, ScriptStep, SelfTest, SensorPart};
use crate::reading::{MagneticReading, little};

/// LIS3MDL.
#[derive(Clone, Copy, Debug, Default)]
pub struct Lis3mdl;

const WHO_AM_I: u8 = 0x0F;
const CTRL_REG1: u8 = 0x20;
const CTRL_REG2: u8 = 0x21;
const CTRL_REG3: u8 = 0x22;
const CTRL_REG4: u8 = 0x23;
const CTRL_REG5: u8 = 0x24;
const STATUS_REG: u8 = 0x27;
const OUT_X_L: u8 = 0x28;

/// Address auto-increment on I2C. On SPI this is the read bit, which is set anyway.
const INCREMENT: u8 = 0x80;
const SOFT_RST: u8 = 0x04;
const ZYXDA: u8 = 0x08;
const UT_PER_LSB: f32 = 100.0 / 6842.0;
/// Scale at 12 gauss.
const UT_PER_LSB_12: f32 = 100.0 / 2281.0;
const RANGE_UT: f32 = 400.0;

impl SensorPart for Lis3mdl {
    type Reading = MagneticReading;
    const NAME: &'static str = "LIS3MDL";
    const SPI: Option<SpiFormat> = Some(SpiFormat { read: 0xC0, write: 0x40, dummies: 0, clock_hz: 10_000_000 });
    const I2C: &'static [u8] = &[0x1E, 0x1C];
    const STUCK_AFTER: u32 = 20;
    /// Self-test as in the data sheet. At 12 gauss and 80 Hz, the part applies a field of its own to each axis.
    const SELF_TEST: Option<SelfTest<MagneticReading>> = Some(SelfTest {
        quiet: &[ScriptStep::Write(CTRL_REG1, 0x1C), ScriptStep::Write(CTRL_REG2, 0x40), ScriptStep::Wait(20_000)],
        trims: &[],
        between: &[],
        stimulated: &[ScriptStep::Write(CTRL_REG1, 0x1D), ScriptStep::Wait(60_000)],
        skipped: 1,
        averaged: 5,
        axes: |reading| {
            // `take` has used the scale of 4 gauss from the set-up; the test measures at 12 gauss.
            let field = reading.field_ut * (UT_PER_LSB_12 / UT_PER_LSB);
            [field.x, field.y, field.z, 0.0, 0.0, 0.0]
        },
        passes: |response| {
            let [x, y, z, ..] = response.change.map(f32::abs);
            [x, y].iter().all(|ut| (100.0..=300.0).contains(ut)) && (10.0..=100.0).contains(&z)
        },
    });
    const SETUP: &'static [ScriptStep] = &[
        ScriptStep::Write(CTRL_REG2, SOFT_RST),
        ScriptStep::Wait(10_000),
        ScriptStep::Identify(WHO_AM_I, &[0x3D]),
        ScriptStep::Set(CTRL_REG1, 0b0111_1100), // x and y ultra-high-performance, 80 Hz
        ScriptStep::Set(CTRL_REG2, 0b0000_0000), // 4 gauss
        ScriptStep::Set(CTRL_REG4, 0b0000_1100), // z ultra-high-performance, low byte first
        ScriptStep::Set(CTRL_REG5, 0b0100_0000), // data blocked until both bytes are read
        ScriptStep::Set(CTRL_REG3, 0b0000_0000), // continuous
    ];
    const CYCLE: &'static [ScriptStep] = &[
        ScriptStep::Wait(10_000),
        ScriptStep::Await(STATUS_REG, ZYXDA, ZYXDA, 15),
        ScriptStep::Read(OUT_X_L | INCREMENT, 6),
    ];

    fn take(&mut self, _: u8, answer: &[u8]) -> Result<Option<MagneticReading>, PartFault> {
        let field_ut = little(answer.try_into().map_err(|_| PartFault::Bus)?) * UT_PER_LSB;
        if field_ut.amax() > RANGE_UT {
            return Err(PartFault::Range);
        }
        Ok(Some(MagneticReading { field_ut }))
    }
}

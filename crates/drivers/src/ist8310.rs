//! iSentek IST8310, over I2C (its data sheet).
//!
//! +-1600 uT; along z +-2480 uT, since 16 bits do not cover the part's 2500 uT. About 95 measurements per second, each
//! commanded and the mean of 16 samples. The data-ready flag is polled; the pin DRDY is not used. The reading's z is
//! reversed, which makes the axes right-handed: forward, right and down if x is forward and the part's face is up. The
//! part's cross-axis table is not used, since a compass calibration covers it.

use crate::bus::SpiFormat;
use crate::part::{PartFault, ScriptStep, SensorPart};
use crate::reading::{MagneticReading, little};
use nalgebra::Vector3;

/// IST8310.
#[derive(Clone, Copy, Debug, Default)]
pub struct Ist8310;

const WAI: u8 = 0x00;
const STAT1: u8 = 0x02;
const DATAXL: u8 = 0x03;
const CNTL1: u8 = 0x0A;
const CNTL2: u8 = 0x0B;
const CNTL3: u8 = 0x0D;
const AVGCNTL: u8 = 0x41;
const PDCNTL: u8 = 0x42;

const DRDY: u8 = 0x01;
const SINGLE_MEASUREMENT: u8 = 0x01;
const SRST: u8 = 0x01;
/// 16-bit output for x, y and z, and the mask of the other bits.
const BITS_16: u8 = 0x70;
const OTHERS_OF_CNTL3: u8 = !BITS_16;
/// 16 samples for y and for x and z, and the mask of the other bits.
const AVERAGE_16: u8 = 0b100_100;
const OTHERS_OF_AVGCNTL: u8 = 0xC0;
/// Normal pulses, which the data sheet requires, and the mask of the other bits.
const PULSE_NORMAL: u8 = 0xC0;
const OTHERS_OF_PDCNTL: u8 = 0x3F;
const UT_PER_LSB: f32 = 1.0 / 13.2;
const RANGE_UT: Vector3<f32> = Vector3::new(1_600.0, 1_600.0, 2_480.0);

impl SensorPart for Ist8310 {
    type Reading = MagneticReading;
    const NAME: &'static str = "IST8310";
    const SPI: Option<SpiFormat> = None;
    const I2C: &'static [u8] = &[0x0E, 0x0C, 0x0D, 0x0F];
    const STUCK_AFTER: u32 = 50; // a quiet part
    const SETUP: &'static [ScriptStep] = &[
        ScriptStep::Write(CNTL2, SRST),
        ScriptStep::Wait(10_000),
        ScriptStep::Await(CNTL2, SRST, 0, 50),
        ScriptStep::Identify(WAI, &[0x10]),
        ScriptStep::SetLike(CNTL3, BITS_16, OTHERS_OF_CNTL3, CNTL3),
        ScriptStep::SetLike(AVGCNTL, AVERAGE_16, OTHERS_OF_AVGCNTL, AVGCNTL),
        ScriptStep::SetLike(PDCNTL, PULSE_NORMAL, OTHERS_OF_PDCNTL, PDCNTL),
    ];
    // A measurement takes 6 ms.
    const CYCLE: &'static [ScriptStep] = &[
        ScriptStep::Write(CNTL1, SINGLE_MEASUREMENT),
        ScriptStep::Wait(10_000),
        ScriptStep::Await(STAT1, DRDY, DRDY, 10),
        ScriptStep::Read(DATAXL, 6),
    ];

    fn take(&mut self, _: u8, answer: &[u8]) -> Result<Option<MagneticReading>, PartFault> {
        let field_ut = little(answer.try_into().map_err(|_| PartFault::Bus)?) * UT_PER_LSB;
        let field_ut = field_ut.component_mul(&Vector3::new(1.0, 1.0, -1.0));
        if field_ut.abs().iter().zip(&RANGE_UT).any(|(ut, max_ut)| ut > max_ut) {
            return Err(PartFault::Range);
        }
        Ok(Some(MagneticReading { field_ut }))
    }
}

//! Bosch BMP388 and BMP390, over SPI or I2C (BST-BMP388-DS001 and BST-BMP390-DS002). Both have the same registers.
//!
//! 300 to 1250 hPa and -40 to 85 degrees C at 50 Hz: 8 samples of pressure and one of temperature, the most that this
//! rate has time for. The part's own filter is off, since it would only add delay. The ready flags are polled; the
//! interrupt is not used. The coefficients have a CRC-8 in the register before them, as in Bosch's self-test.

use crate::bus::SpiFormat;
use crate::part::{PartFault, ScriptStep, SensorPart};
use crate::reading::{PressureReading, in_range};

/// BMP388.
pub type Bmp388 = Bmp3<0x50>;
/// BMP390.
pub type Bmp390 = Bmp3<0x60>;

/// A part of the family, with the given value of CHIP_ID.
#[derive(Clone, Copy, Debug, Default)]
pub struct Bmp3<const IDENTITY: u8> {
    /// Coefficients, if their CRC is correct.
    coefficients: Option<Bmp3Coefficients>,
}

/// Coefficients, named and scaled as in section 9.1 of the data sheet.
#[derive(Clone, Copy, Debug)]
struct Bmp3Coefficients {
    t1: f32,
    t2: f32,
    t3: f32,
    p1: f32,
    p2: f32,
    p3: f32,
    p4: f32,
    p5: f32,
    p6: f32,
    p7: f32,
    p8: f32,
    p9: f32,
    p10: f32,
    p11: f32,
}

const CHIP_ID: u8 = 0x00;
const STATUS: u8 = 0x03;
const DATA_0: u8 = 0x04;
const PWR_CTRL: u8 = 0x1B;
const OSR: u8 = 0x1C;
const ODR: u8 = 0x1D;
const CONFIG: u8 = 0x1F;
/// The CRC, which the data sheet does not name, followed by NVM_PAR_T1 to NVM_PAR_P11.
const CALIBRATION: u8 = 0x30;
const CALIBRATION_LENGTH: usize = 22;
const CMD: u8 = 0x7E;

const SOFTRESET: u8 = 0xB6;
/// Bits of STATUS: drdy_temp and drdy_press.
const DRDY: u8 = 0x60;
const RANGE_PA: [f32; 2] = [30_000.0, 125_000.0];
const RANGE_C: [f32; 2] = [-40.0, 85.0];

impl<const IDENTITY: u8> SensorPart for Bmp3<IDENTITY> {
    type Reading = PressureReading;
    const NAME: &'static str = if IDENTITY == 0x50 { "BMP388" } else { "BMP390" };
    const SPI: Option<SpiFormat> = Some(SpiFormat { read: 0x80, write: 0, dummies: 1, clock_hz: 10_000_000 });
    const I2C: &'static [u8] = &[0x76, 0x77];
    const STUCK_AFTER: u32 = 20;
    const SETUP: &'static [ScriptStep] = &[
        ScriptStep::Write(CMD, SOFTRESET),
        ScriptStep::Wait(5_000), // 2 ms and a margin
        ScriptStep::Identify(CHIP_ID, &[IDENTITY]),
        ScriptStep::Read(CALIBRATION, CALIBRATION_LENGTH),
        ScriptStep::Set(OSR, 0b000_011), // temperature once, pressure 8 times
        ScriptStep::Set(ODR, 0x02),      // 50 Hz
        ScriptStep::Set(CONFIG, 0),
        ScriptStep::Set(PWR_CTRL, 0x33), // pressure and temperature, normal mode
    ];
    const CYCLE: &'static [ScriptStep] =
        &[ScriptStep::Wait(17_000), ScriptStep::Await(STATUS, DRDY, DRDY, 23), ScriptStep::Read(DATA_0, 6)];

    fn take(&mut self, register: u8, answer: &[u8]) -> Result<Option<PressureReading>, PartFault> {
        if register == CALIBRATION {
            // Discards the coefficients of the last set-up, which must not stay in use if the new ones are damaged.
            self.coefficients = None;
            let (&check, trim) = answer.split_first().ok_or(PartFault::Bus)?;
            if crc(trim) != check {
                return Err(PartFault::Calibration);
            }
            self.coefficients = Some(Bmp3Coefficients::new(trim.try_into().map_err(|_| PartFault::Bus)?));
            return Ok(None);
        }
        let &[p0, p1, p2, t0, t1, t2] = answer else { return Err(PartFault::Bus) };
        let coefficients = self.coefficients.ok_or(PartFault::Calibration)?;
        let [pressure, temperature] = [[p0, p1, p2, 0], [t0, t1, t2, 0]].map(|raw| u32::from_le_bytes(raw) as f32);
        in_range(coefficients.compensate(pressure, temperature), RANGE_PA, RANGE_C)
    }
}

impl Bmp3Coefficients {
    fn new(trim: [u8; 21]) -> Self {
        let [a, b, c, d, t3, e, f, g, h, p3, p4, i, j, k, l, p7, p8, m, n, p10, p11] = trim;
        let byte = |value: u8| f32::from(value.cast_signed());
        let word = |low, high| f32::from(u16::from_le_bytes([low, high]));
        let signed = |low, high| f32::from(i16::from_le_bytes([low, high]));
        Bmp3Coefficients {
            t1: word(a, b) * exp2(8),
            t2: word(c, d) * exp2(-30),
            t3: byte(t3) * exp2(-48),
            p1: (signed(e, f) - exp2(14)) * exp2(-20),
            p2: (signed(g, h) - exp2(14)) * exp2(-29),
            p3: byte(p3) * exp2(-32),
            p4: byte(p4) * exp2(-37),
            p5: word(i, j) * exp2(3),
            p6: word(k, l) * exp2(-6),
            p7: byte(p7) * exp2(-8),
            p8: byte(p8) * exp2(-15),
            p9: signed(m, n) * exp2(-48),
            p10: byte(p10) * exp2(-48),
            p11: byte(p11) * exp2(-65),
        }
    }

    fn compensate(&self, p: f32, temperature: f32) -> PressureReading {
        let Bmp3Coefficients { t1, t2, t3, p1, p2, p3, p4, p5, p6, p7, p8, p9, p10, p11 } = *self;
        let above = temperature - t1;
        let t = above * (t2 + above * t3);
        let constant = p5 + t * (p6 + t * (p7 + t * p8));
        let linear = p1 + t * (p2 + t * (p3 + t * p4));
        let pressure_pa = constant + p * (linear + p * (p9 + p10 * t + p * p11));
        PressureReading { pressure_pa, temperature_c: t }
    }
}

/// Returns two to this power, which must be within -126 to 127.
const fn exp2(power: i32) -> f32 {
    f32::from_bits(((127 + power) << 23).cast_unsigned())
}

/// Returns the CRC-8 of SAE J1850: polynomial 0x1D, initially all ones, inverted.
fn crc(bytes: &[u8]) -> u8 {
    !bytes
        .iter()
        .fold(0xFF, |crc: u8, byte| (0..8).fold(crc ^ byte, |crc, _| crc << 1 ^ if crc & 0x80 == 0 { 0 } else { 0x1D }))
}

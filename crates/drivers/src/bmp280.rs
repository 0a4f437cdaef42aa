//! Bosch BMP280, over I2C (BST-BMP280-DS001).
//!
//! 300 to 1100 hPa and -40 to 85 degrees C, about 40 times per second: one sample of temperature and 8 of pressure,
//! without the part's own filter. The part has no interrupt and no data-ready flag, so each measurement is commanded
//! (forced mode). The coefficients have no checksum, so they are read twice. One register is set to a value other than
//! its default and checked in each cycle, to detect a reset.
//!
//! Not over SPI: there, writes use register addresses with the highest bit cleared, which [`SpiFormat`] cannot express.

use crate::bus::SpiFormat;
use crate::part::{PartFault, ScriptStep, SensorPart};
use crate::reading::{PressureReading, in_range};

/// BMP280.
#[derive(Clone, Copy, Debug, Default)]
pub struct Bmp280 {
    /// Raw coefficients as last read.
    raw: [u8; CALIBRATION_LENGTH],
    /// Decoded coefficients, if two reads agreed.
    coefficients: Option<Bmp280Coefficients>,
}

/// Coefficients, named as in table 17 of the data sheet.
#[derive(Clone, Copy, Debug)]
struct Bmp280Coefficients {
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
}

/// Address of the coefficients dig_T1 to dig_P9.
const CALIBRATION: u8 = 0x88;
const CALIBRATION_LENGTH: usize = 24;
const ID: u8 = 0xD0;
const RESET: u8 = 0xE0;
const STATUS: u8 = 0xF3;
const CTRL_MEAS: u8 = 0xF4;
const CONFIG: u8 = 0xF5;
const PRESS_MSB: u8 = 0xF7;

const IDENTITY: u8 = 0x58;
const SOFT_RESET: u8 = 0xB6;
/// Bits of STATUS: measuring; copying the calibration.
const MEASURING: u8 = 0x08;
const IM_UPDATE: u8 = 0x01;
/// Value of CTRL_MEAS: temperature once, pressure 8 times, forced mode.
const FORCED: u8 = 0b0011_0001;
/// Filter off. The standby time has no effect in forced mode; it only differs from its default, to detect a reset.
const CONFIG_VALUE: u8 = 0b0010_0000;
/// Longest measurement: 1.25 + 2.3 + 8 * 2.3 + 0.575 ms (section 3.8.1).
const MEASUREMENT_US: u32 = 22_600;
/// Raw value without a measurement.
const SKIPPED: u32 = 0x80000;
const RANGE_PA: [f32; 2] = [30_000.0, 110_000.0];
const RANGE_C: [f32; 2] = [-40.0, 85.0];

impl SensorPart for Bmp280 {
    type Reading = PressureReading;
    const NAME: &'static str = "BMP280";
    const SPI: Option<SpiFormat> = None;
    const I2C: &'static [u8] = &[0x76, 0x77];
    const STUCK_AFTER: u32 = 20;
    const SETUP: &'static [ScriptStep] = &[
        ScriptStep::Write(RESET, SOFT_RESET),
        ScriptStep::Wait(3_000), // 2 ms and a margin
        ScriptStep::Identify(ID, &[IDENTITY]),
        ScriptStep::Await(STATUS, IM_UPDATE, 0, 10),
        ScriptStep::Read(CALIBRATION, CALIBRATION_LENGTH),
        ScriptStep::Read(CALIBRATION, CALIBRATION_LENGTH),
        ScriptStep::Set(CONFIG, CONFIG_VALUE),
    ];
    const CYCLE: &'static [ScriptStep] = &[
        ScriptStep::Write(CTRL_MEAS, FORCED),
        ScriptStep::Wait(MEASUREMENT_US),
        ScriptStep::Await(STATUS, MEASURING, 0, 5),
        ScriptStep::Await(CONFIG, 0xFF, CONFIG_VALUE, 0), // checks that no reset has occurred
        ScriptStep::Read(PRESS_MSB, 6),
    ];

    fn take(&mut self, register: u8, answer: &[u8]) -> Result<Option<PressureReading>, PartFault> {
        if register == CALIBRATION {
            let answer = answer.try_into().map_err(|_| PartFault::Bus)?;
            self.coefficients = (self.raw == answer).then(|| Bmp280Coefficients::new(answer));
            self.raw = answer;
            return Ok(None);
        }
        let &[p2, p1, p0, t2, t1, t0] = answer else { return Err(PartFault::Bus) };
        let coefficients = self.coefficients.ok_or(PartFault::Calibration)?;
        let raw = [[0, p2, p1, p0], [0, t2, t1, t0]].map(|raw| u32::from_be_bytes(raw) >> 4);
        if raw.contains(&SKIPPED) {
            return Err(PartFault::Late);
        }
        let [pressure, temperature] = raw.map(|raw| raw as f32);
        in_range(coefficients.compensate(pressure, temperature), RANGE_PA, RANGE_C)
    }
}

impl Bmp280Coefficients {
    fn new(raw: [u8; CALIBRATION_LENGTH]) -> Self {
        let [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x] = raw;
        let word = |low, high| f32::from(u16::from_le_bytes([low, high]));
        let signed = |low, high| f32::from(i16::from_le_bytes([low, high]));
        Bmp280Coefficients {
            t1: word(a, b),
            t2: signed(c, d),
            t3: signed(e, f),
            p1: word(g, h),
            p2: signed(i, j),
            p3: signed(k, l),
            p4: signed(m, n),
            p5: signed(o, p),
            p6: signed(q, r),
            p7: signed(s, t),
            p8: signed(u, v),
            p9: signed(w, x),
        }
    }

    /// Computes section 8.1 with the powers of 2 combined. A `p1` of 0 gives NaN or infinity, which is out of range.
    fn compensate(&self, pressure: f32, temperature: f32) -> PressureReading {
        let Bmp280Coefficients { t1, t2, t3, p1, p2, p3, p4, p5, p6, p7, p8, p9 } = *self;
        let above = temperature / 16_384.0 - t1 / 1_024.0;
        let fine = above * t2 + above * above * t3 / 64.0;
        let warm = fine / 2.0 - 64_000.0;
        let offset = (warm * (warm * (p6 / 32_768.0) + p5 * 2.0) / 4.0 + p4 * 65_536.0) / 4_096.0;
        let slope = (1.0 + warm * (warm * (p3 / 524_288.0) + p2) / 524_288.0 / 32_768.0) * p1;
        let plain = (1_048_576.0 - pressure - offset) * 6_250.0 / slope;
        let bend = (plain * (plain * (p9 / 2_147_483_648.0) + p8 / 32_768.0) + p7) / 16.0;
        PressureReading { pressure_pa: plain + bend, temperature_c: fine / 5_120.0 }
    }
}

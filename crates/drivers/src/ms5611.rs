//! TE Connectivity MS5611-01BA03, over SPI or I2C (ENG_DS_MS5611-01BA03_B3).
//!
//! 10 to 1200 mbar and -40 to 85 degrees C, about 50 times per second: a temperature and a pressure, each of 4096
//! samples (1.2 Pa rms), with the second-order compensation for cold. The part has no interrupt, no identity and no
//! registers, only commands. Its PROM has a CRC-4; the PROM word with the CRC is read in each cycle, since it reads
//! differently after an unexpected reset. An MS5607 has the same commands, but would read a quite different pressure.

use crate::bus::SpiFormat;
use crate::part::{PartFault, ScriptStep, SensorPart};
use crate::reading::{PressureReading, in_range};

/// MS5611.
#[derive(Clone, Copy, Debug, Default)]
pub struct Ms5611 {
    prom: [u16; 8],
    /// C1 to C6, if the PROM's CRC is correct.
    coefficients: Option<[i64; 6]>,
    /// D2 (temperature) of this cycle.
    d2: Option<i64>,
}

// Commands.
const ADC_READ: u8 = 0x00;
const RESET: u8 = 0x1E;
const CONVERT_D1_4096: u8 = 0x48;
const CONVERT_D2_4096: u8 = 0x58;
const PROM_READ: u8 = 0xA0;
const PROM_READ_LAST: u8 = 0xAE;

/// Longest conversion of 4096 samples, 9.04 ms, with a margin for clock error \[us\].
const CONVERSION_US: u32 = 9_300;
const RANGE_PA: [f32; 2] = [1_000.0, 120_000.0];
const RANGE_C: [f32; 2] = [-40.0, 85.0];

impl SensorPart for Ms5611 {
    type Reading = PressureReading;
    const NAME: &'static str = "MS5611";
    const SPI: Option<SpiFormat> = Some(SpiFormat { read: 0, write: 0, dummies: 0, clock_hz: 20_000_000 });
    const I2C: &'static [u8] = &[0x77, 0x76];
    const STUCK_AFTER: u32 = 20;
    const SETUP: &'static [ScriptStep] = &[
        ScriptStep::Wait(CONVERSION_US), // a conversion may be running
        ScriptStep::WriteAll(RESET, &[]),
        ScriptStep::Wait(5_000), // reloads its PROM in 2.8 ms
        ScriptStep::Read(PROM_READ, 2),
        ScriptStep::Read(PROM_READ + 2, 2),
        ScriptStep::Read(PROM_READ + 4, 2),
        ScriptStep::Read(PROM_READ + 6, 2),
        ScriptStep::Read(PROM_READ + 8, 2),
        ScriptStep::Read(PROM_READ + 10, 2),
        ScriptStep::Read(PROM_READ + 12, 2),
        ScriptStep::Read(PROM_READ_LAST, 2),
    ];
    const CYCLE: &'static [ScriptStep] = &[
        ScriptStep::Read(PROM_READ_LAST, 2),
        ScriptStep::WriteAll(CONVERT_D2_4096, &[]),
        ScriptStep::Wait(CONVERSION_US),
        ScriptStep::Read(ADC_READ, 3),
        ScriptStep::WriteAll(CONVERT_D1_4096, &[]),
        ScriptStep::Wait(CONVERSION_US),
        ScriptStep::Read(ADC_READ, 3),
    ];

    fn take(&mut self, command: u8, answer: &[u8]) -> Result<Option<PressureReading>, PartFault> {
        match *answer {
            [high, low] => self.take_prom(command, u16::from_be_bytes([high, low])).map(|()| None),
            [high, middle, low] => self.take_adc(i64::from(u32::from_be_bytes([0, high, middle, low]))),
            _ => Err(PartFault::Bus),
        }
    }
}

impl Ms5611 {
    fn take_prom(&mut self, command: u8, value: u16) -> Result<(), PartFault> {
        // Each cycle begins with the PROM. The temperature of an earlier, incomplete cycle must not be used for this
        // cycle.
        self.d2 = None;
        let at = usize::from(command.wrapping_sub(PROM_READ) / 2);
        let word = self.prom.get_mut(at).ok_or(PartFault::Bus)?;
        let is_known = self.coefficients.is_some();
        match command {
            PROM_READ_LAST if is_known && *word == value => return Ok(()),
            PROM_READ_LAST if is_known => return Err(PartFault::Calibration),
            PROM_READ => self.coefficients = None, // new set-up
            _ => (),
        }
        *word = value;
        if command == PROM_READ_LAST {
            self.coefficients = Some(coefficients(self.prom)?);
        }
        Ok(())
    }

    fn take_adc(&mut self, value: i64) -> Result<Option<PressureReading>, PartFault> {
        let coefficients = self.coefficients.ok_or(PartFault::Calibration)?;
        // An interrupted or missing conversion gives 0.
        if value == 0 {
            return Err(PartFault::Silent);
        }
        let Some(d2) = self.d2.take() else {
            self.d2 = Some(value);
            return Ok(None);
        };
        in_range(compensate(coefficients, value, d2), RANGE_PA, RANGE_C)
    }
}

/// Returns C1 to C6 if the PROM is valid.
fn coefficients(prom: [u16; 8]) -> Result<[i64; 6], PartFault> {
    let [first, c1, c2, c3, c4, c5, c6, last] = prom;
    if prom.iter().all(|&word| word == 0) || prom.iter().all(|&word| word == 0xFFFF) {
        return Err(PartFault::Silent);
    }
    let mut remainder = 0;
    for byte in [first, c1, c2, c3, c4, c5, c6, last & 0xFF00].into_iter().flat_map(u16::to_be_bytes) {
        remainder = (0..8).fold(remainder ^ u16::from(byte), |remainder: u16, _| {
            remainder << 1 ^ if remainder & 0x8000 == 0 { 0 } else { 0x3000 }
        });
    }
    if remainder >> 12 != last & 0xF || [c1, c2, c3, c4, c5, c6].contains(&0) {
        return Err(PartFault::Calibration);
    }
    Ok([c1, c2, c3, c4, c5, c6].map(i64::from))
}

/// Computes figures 2 and 3 of the data sheet in its integer arithmetic.
fn compensate([c1, c2, c3, c4, c5, c6]: [i64; 6], d1: i64, d2: i64) -> PressureReading {
    let dt = d2 - (c5 << 8);
    let mut temp = 2_000 + ((dt * c6) >> 23);
    let mut off = (c2 << 16) + ((c4 * dt) >> 7);
    let mut sens = (c1 << 15) + ((c3 * dt) >> 8);
    if temp < 2_000 {
        let below_20_c = (temp - 2_000).pow(2);
        off -= (5 * below_20_c) >> 1;
        sens -= (5 * below_20_c) >> 2;
        if temp < -1_500 {
            let below_minus_15_c = (temp + 1_500).pow(2);
            off -= 7 * below_minus_15_c;
            sens -= (11 * below_minus_15_c) >> 1;
        }
        temp -= (dt * dt) >> 31;
    }
    PressureReading {
        // The data sheet truncates to whole pascals; this keeps the fraction.
        pressure_pa: (((d1 * sens) >> 21) - off) as f32 / 32_768.0,
        temperature_c: temp as f32 / 100.0,
    }
}

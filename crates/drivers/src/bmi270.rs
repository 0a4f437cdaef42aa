//! Bosch BMI270, over SPI (BST-BMI270-DS000).
//!
//! +-2000 deg/s and +-16 g, both at 1.6 kHz. The part's filters run in performance mode with two-fold oversampling
//! (OSR2), which halves the bandwidth of its normal filters. The interrupt INT1 gives an active-high pulse for each
//! sample.
//!
//! The part works only after a configuration of 8 KiB was loaded, which takes 7 ms at 10 MHz. It is Bosch's (Copyright
//! 2023 Bosch Sensortec GmbH, BSD-3-Clause, `bmi270_config_file` of its `BMI270_SensorAPI`), taken from the crate
//! `bmi2`. With DMA, the block must be sent from flash in one transfer.
//!
//! The gyroscope's x axis is slightly sensitive to z. The register GYR_CAS gives the cross-sensitivity, and the reading
//! is corrected.

use crate::bus::SpiFormat;
use crate::part::{PartFault, ScriptStep, SelfTest, SensorPart};
use crate::reading::{InertialReading, little};
use crate::self_test::numbers;
use bmi2::config::BMI270_CONFIG_FILE;

/// BMI270.
#[derive(Clone, Copy, Debug, Default)]
pub struct Bmi270 {
    /// Cross-sensitivity of the gyroscope's x axis to z.
    zx: f32,
    /// Temperature in the last cycle.
    temperature_c: Option<f32>,
}

const CHIP_ID: u8 = 0x00;
const DATA_8: u8 = 0x0C;
const INTERNAL_STATUS: u8 = 0x21;
/// On feature page 0, which is selected after a reset.
const GYR_CAS: u8 = 0x3C;
const ACC_CONF: u8 = 0x40;
const ACC_RANGE: u8 = 0x41;
const GYR_CONF: u8 = 0x42;
const GYR_RANGE: u8 = 0x43;
const INT1_IO_CTRL: u8 = 0x53;
const INT_LATCH: u8 = 0x55;
const INT_MAP_DATA: u8 = 0x58;
const INIT_CTRL: u8 = 0x59;
const INIT_DATA: u8 = 0x5E;
const ACC_SELF_TEST: u8 = 0x6D;
const PWR_CONF: u8 = 0x7C;
const PWR_CTRL: u8 = 0x7D;
const CMD: u8 = 0x7E;

/// Mask of INTERNAL_STATUS, and its value once the configuration works.
const MESSAGE: u8 = 0x0F;
const INIT_OK: u8 = 1;
/// Raw value of a temperature that has not been measured yet.
const INVALID: i16 = i16::MIN;
const RAD_S_PER_LSB: f32 = 2000.0 / 32768.0 * core::f32::consts::PI / 180.0;
const M_S2_PER_LSB: f32 = 16.0 / 32768.0 * 9.806_65;

impl SensorPart for Bmi270 {
    type Reading = InertialReading;
    const NAME: &'static str = "BMI270";
    const SPI: Option<SpiFormat> = Some(SpiFormat { read: 0x80, write: 0, dummies: 1, clock_hz: 10_000_000 });
    const I2C: &'static [u8] = &[];
    const STUCK_AFTER: u32 = 20;
    /// Self-test of the accelerometer as in the data sheet: deflection to either side in turn, at 16 g and 1.6 kHz. The
    /// gyroscope's self-test needs another feature of the configuration and is not run.
    const SELF_TEST: Option<SelfTest<InertialReading>> = Some(SelfTest {
        // The self-test is enabled with a large amplitude, first in the negative direction.
        quiet: &[ScriptStep::Write(ACC_SELF_TEST, 0b1001), ScriptStep::Wait(50_000)],
        trims: &[],
        between: &[],
        stimulated: &[ScriptStep::Write(ACC_SELF_TEST, 0b1101), ScriptStep::Wait(50_000)],
        skipped: 1,
        averaged: 16,
        axes: numbers,
        passes: |response| {
            let [.., x, y, z] = response.change.map(|change| change * 16.0 / 32768.0);
            x > 16.0 && y < -15.0 && z > 10.0
        },
    });
    const SETUP: &'static [ScriptStep] = &[
        ScriptStep::Await(CHIP_ID, 0, 0, 0), // dummy read: the edge of chip select switches from I2C to SPI
        ScriptStep::Wait(450),
        ScriptStep::Write(CMD, 0xB6), // soft reset, back to I2C
        ScriptStep::Wait(2_000),
        ScriptStep::Await(CHIP_ID, 0, 0, 0),
        ScriptStep::Wait(450),
        ScriptStep::Identify(CHIP_ID, &[0x24]),
        ScriptStep::Set(PWR_CONF, 0), // power saving off, since it would lose writes
        ScriptStep::Wait(450),
        ScriptStep::Write(INIT_CTRL, 0),
        ScriptStep::WriteAll(INIT_DATA, &BMI270_CONFIG_FILE),
        ScriptStep::Write(INIT_CTRL, 1),
        ScriptStep::Wait(20_000),
        ScriptStep::Await(INTERNAL_STATUS, MESSAGE, INIT_OK, 150),
        ScriptStep::Set(ACC_CONF, 0x9C),       // performance mode, OSR2, 1.6 kHz
        ScriptStep::Set(ACC_RANGE, 3),         // 16 g
        ScriptStep::Set(GYR_CONF, 0xDC),       // performance mode for noise and filter, OSR2, 1.6 kHz
        ScriptStep::Set(GYR_RANGE, 0),         // 2000 deg/s
        ScriptStep::Set(INT1_IO_CTRL, 0b1010), // output, push-pull, active high
        ScriptStep::Set(INT_LATCH, 0),
        ScriptStep::Set(INT_MAP_DATA, 0b100), // data ready on INT1
        ScriptStep::Set(PWR_CTRL, 0b1110),    // accelerometer, gyroscope, temperature
        ScriptStep::Wait(50_000),             // gyroscope start-up; it reads 0 before
        ScriptStep::Read(GYR_CAS, 1),
    ];
    const CYCLE: &'static [ScriptStep] =
        &[ScriptStep::Ready(1_250), ScriptStep::Read(DATA_8, 12), ScriptStep::Read(INTERNAL_STATUS, 3)];

    fn take(&mut self, register: u8, answer: &[u8]) -> Result<Option<InertialReading>, PartFault> {
        match (register, answer) {
            // Signed seven-bit number in units of 1/512.
            (GYR_CAS, &[cas]) => self.zx = f32::from((cas << 1).cast_signed() >> 1) / 512.0,
            (INTERNAL_STATUS, &[status, t0, t1]) => {
                if status & MESSAGE != INIT_OK {
                    return Err(PartFault::Register(INTERNAL_STATUS));
                }
                let temperature = i16::from_le_bytes([t0, t1]);
                self.temperature_c = (temperature != INVALID).then(|| f32::from(temperature) / 512.0 + 23.0);
            }
            (DATA_8, &[ref force @ .., r0, r1, r2, r3, r4, r5]) => {
                let force = little(force.try_into().map_err(|_| PartFault::Bus)?);
                let mut rates = little([r0, r1, r2, r3, r4, r5]);
                rates.x = (rates.x - self.zx * rates.z).clamp(-32768.0, 32767.0);
                // None in the first cycle: status and temperature are read after the data.
                return Ok(self.temperature_c.map(|temperature_c| InertialReading {
                    rates_rad_s: rates * RAD_S_PER_LSB,
                    specific_force_m_s2: force * M_S2_PER_LSB,
                    temperature_c,
                }));
            }
            _ => return Err(PartFault::Bus),
        }
        Ok(None)
    }
}

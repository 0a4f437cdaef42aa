//! TDK ICM-42688-P and ICM-42605, over SPI (DS-000347 and DS-000292). Both have the same registers.
//!
//! +-2000 deg/s and +-16 g, each behind the part's own second-order filter of 250 Hz, which is also the anti-alias
//! filter for readings at 1 kHz. The interrupt INT1 gives an active-high pulse for each sample. The part measures at 1
//! kHz. For readings by the board's clock it measures at 4 kHz, so that a reading is never older than 0.25 ms.
//!
//! The parts have an adaptive full-scale range (AFSR), which the data sheets do not mention. It is on after a reset,
//! and freezes the gyroscope for 1 to 2 ms whenever a rate crosses about 100 deg/s. This driver switches it off, like
//! Betaflight, ArduPilot (issue 25025) and PX4 (issue 22254).

use crate::bus::SpiFormat;
use crate::part::{PartFault, ScriptStep, SelfTest, SensorPart};
use crate::reading::{InertialReading, big};
use crate::self_test::{as_at_the_factory, numbers};

/// ICM-42688-P.
pub type Icm42688p<const POLLED: bool = false> = Icm426xx<0x47, POLLED>;
/// ICM-42605.
pub type Icm42605<const POLLED: bool = false> = Icm426xx<0x42, POLLED>;

/// A part of the family, with the given value of WHO_AM_I; `POLLED` if it is read by the board's clock.
#[derive(Clone, Copy, Debug, Default)]
pub struct Icm426xx<const IDENTITY: u8, const POLLED: bool>;

// Registers of bank 0.
const DEVICE_CONFIG: u8 = 0x11;
const INT_CONFIG: u8 = 0x14;
const TEMP_DATA1: u8 = 0x1D;
const INTF_CONFIG0: u8 = 0x4C;
const INTF_CONFIG1: u8 = 0x4D;
const PWR_MGMT0: u8 = 0x4E;
const GYRO_CONFIG0: u8 = 0x4F;
const ACCEL_CONFIG0: u8 = 0x50;
const GYRO_ACCEL_CONFIG0: u8 = 0x52;
const INT_CONFIG1: u8 = 0x64;
const INT_SOURCE0: u8 = 0x65;
const SELF_TEST_CONFIG: u8 = 0x70;
const WHO_AM_I: u8 = 0x75;
const REG_BANK_SEL: u8 = 0x76;
/// First register of the self-test values: XG in bank 1, XA in bank 2.
const XG_ST_DATA: u8 = 0x5F;
const XA_ST_DATA: u8 = 0x3B;

/// INTF_CONFIG1 as after a reset (0x91), except the two upper bits, which switch AFSR off.
const AFSR_OFF: u8 = 0x51;
/// Bits of INT_CONFIG1: a pulse of 8 us without a minimum pause after it, as required at 4 kHz. The data sheet also
/// requires INT_ASYNC_RESET to be off.
const SHORT_PULSE: u8 = 0x60;

/// Length of temperature, specific force and rates \[bytes\].
const LENGTH: usize = 14;
/// Raw value of an axis that has not been measured yet.
const INVALID: f32 = -32768.0;
const RAD_S_PER_LSB: f32 = 2000.0 / 32768.0 * core::f32::consts::PI / 180.0;
const M_S2_PER_LSB: f32 = 16.0 / 32768.0 * 9.806_65;

impl<const IDENTITY: u8, const POLLED: bool> SensorPart for Icm426xx<IDENTITY, POLLED> {
    type Reading = InertialReading;
    const NAME: &'static str = if IDENTITY == 0x47 { "ICM-42688-P" } else { "ICM-42605" };
    const SPI: Option<SpiFormat> = Some(SpiFormat { read: 0x80, write: 0, dummies: 0, clock_hz: 24_000_000 });
    const I2C: &'static [u8] = &[];
    const STUCK_AFTER: u32 = 20;
    /// Self-test as in TDK's own driver for the family: 250 deg/s and 2 g, all six axes at once. The factory's
    /// responses are in banks 1 and 2.
    const SELF_TEST: Option<SelfTest<InertialReading>> = Some(SelfTest {
        quiet: &[
            ScriptStep::Write(GYRO_CONFIG0, if POLLED { 0x64 } else { 0x66 }),
            ScriptStep::Write(ACCEL_CONFIG0, if POLLED { 0x64 } else { 0x66 }),
            ScriptStep::Wait(60_000),
        ],
        trims: &[(ScriptStep::Write(REG_BANK_SEL, 1), XG_ST_DATA), (ScriptStep::Write(REG_BANK_SEL, 2), XA_ST_DATA)],
        between: &[ScriptStep::Write(REG_BANK_SEL, 0)],
        stimulated: &[ScriptStep::Write(SELF_TEST_CONFIG, 0x7F), ScriptStep::Wait(200_000)],
        skipped: 2,
        averaged: 100,
        axes: numbers,
        passes: |response| as_at_the_factory(response, [0.05, 1.2]),
    });
    const SETUP: &'static [ScriptStep] = &[
        ScriptStep::Write(REG_BANK_SEL, 0),
        ScriptStep::Write(DEVICE_CONFIG, 1), // soft reset; the SPI mode stays
        ScriptStep::Wait(2_000),
        ScriptStep::Identify(WHO_AM_I, &[IDENTITY]),
        ScriptStep::Set(INTF_CONFIG0, 0x30), // big endian, no held values: as after a reset
        ScriptStep::Set(INTF_CONFIG1, AFSR_OFF),
        ScriptStep::Set(INT_CONFIG, 0b011), // INT1 pulsed, push-pull, active high
        ScriptStep::Set(INT_CONFIG1, SHORT_PULSE),
        ScriptStep::Set(INT_SOURCE0, 0b1000),
        // 2000 deg/s and 16 g, at 4 kHz or 1 kHz; filter bandwidth a sixteenth or a quarter of the rate.
        ScriptStep::Set(GYRO_CONFIG0, if POLLED { 0x04 } else { 0x06 }),
        ScriptStep::Set(ACCEL_CONFIG0, if POLLED { 0x04 } else { 0x06 }),
        ScriptStep::Set(GYRO_ACCEL_CONFIG0, if POLLED { 0x55 } else { 0x11 }),
        ScriptStep::Set(PWR_MGMT0, 0x0F), // both in low-noise mode
        ScriptStep::Wait(45_000),         // gyroscope start-up
    ];
    const CYCLE: &'static [ScriptStep] =
        &[ScriptStep::Ready(if POLLED { 500 } else { 2_000 }), ScriptStep::Read(TEMP_DATA1, LENGTH)];

    fn take(&mut self, _: u8, answer: &[u8]) -> Result<Option<InertialReading>, PartFault> {
        let &[t1, t0, ref force @ .., r5, r4, r3, r2, r1, r0] = answer else { return Err(PartFault::Bus) };
        let force = big(force.try_into().map_err(|_| PartFault::Bus)?);
        let rates = big([r5, r4, r3, r2, r1, r0]);
        if force.iter().chain(&rates).any(|&axis| axis == INVALID) {
            return Ok(None);
        }
        Ok(Some(InertialReading {
            rates_rad_s: rates * RAD_S_PER_LSB,
            specific_force_m_s2: force * M_S2_PER_LSB,
            temperature_c: f32::from(i16::from_be_bytes([t1, t0])) / 132.48 + 25.0,
        }))
    }
}

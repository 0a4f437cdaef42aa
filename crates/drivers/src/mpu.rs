//! TDK InvenSense's family of the MPU-6000, over SPI.
//!
//! +-2000 deg/s and +-16 g at 1 kHz. The interrupt INT gives an active-high pulse of 50 us for each sample.
//!
//! | part | register map | gyroscope filter | accelerometer filter | SPI clock |
//! |---|---|---|---|---|
//! | MPU-6000 | RM-MPU-6000A | 256 Hz, 0.98 ms | 260 Hz | 1 MHz |
//! | MPU-6500 | RM-MPU-6500A | 184 Hz, 2.9 ms | 218 Hz, 1.9 ms | 1 MHz |
//! | MPU-9250 | RM-MPU-9250A | 184 Hz, 2.9 ms | 218 Hz, 1.9 ms | 1 MHz |
//! | ICM-20602 | DS-000176 | 176 Hz | 218 Hz | 10 MHz |
//! | ICM-20608-G | RM-000030 | 176 Hz | 218 Hz | 8 MHz |
//! | ICM-20689 | DS-000143 | 176 Hz | 218 Hz | 8 MHz |
//!
//! The filters are the widest that each part has at 1 kHz (DLPF_CFG). Only the MPU-6000 can divide the 8 kHz of its
//! widest filter down to 1 kHz. The others always give 8 kHz with their widest filter (250 Hz), so they use the next
//! narrower filter. The parts called MPU allow more than 1 MHz only for sensor registers; at 1 MHz, a reading takes
//! 0.12 ms.
//!
//! The part's I2C interface is switched off, so that it cannot react to other parts' traffic on the bus: in USER_CTRL,
//! or in I2C_IF for the ICM-20602. Early MPU-6000 (revision C, of 2011) read half the specific force and cannot be told
//! from later ones.

use crate::bus::SpiFormat;
use crate::part::{PartFault, ScriptStep, SelfTest, SelfTestResponse, SensorPart};
use crate::reading::{InertialReading, big};
use crate::self_test::{as_at_the_factory, numbers};

/// MPU-6000.
pub type Mpu6000 = Mpu<0x68>;
/// MPU-6500.
pub type Mpu6500 = Mpu<0x70>;
/// MPU-9250 without its magnetometer; [`crate::ak8963::Mpu9250Ak8963`] reads both.
pub type Mpu9250 = Mpu<0x71>;
/// ICM-20602.
pub type Icm20602 = Mpu<0x12>;
/// ICM-20608-G.
pub type Icm20608 = Mpu<0xAF>;
/// ICM-20689.
pub type Icm20689 = Mpu<0x98>;

/// A part of the family, with the given value of WHO_AM_I.
#[derive(Clone, Copy, Debug, Default)]
pub struct Mpu<const IDENTITY: u8>;

/// Unnamed register. According to ArduPilot's driver, ICM-20602 and ICM-20608 measure y of the specific force wrongly
/// by up to 2.7 m/s2 if it holds another value.
const REGISTER_17: u8 = 0x11;
/// Factory's self-test responses: two registers of the MPU-6000, then two of MPU-6500 and MPU-9250.
const SELF_TEST_X: u8 = 0x0D;
const SELF_TEST_A: u8 = 0x10;
const SELF_TEST_X_GYRO: u8 = 0x00;
const SELF_TEST_X_ACCEL: u8 = 0x0D;
const SMPLRT_DIV: u8 = 0x19;
const CONFIG: u8 = 0x1A;
const GYRO_CONFIG: u8 = 0x1B;
const ACCEL_CONFIG: u8 = 0x1C;
const ACCEL_CONFIG_2: u8 = 0x1D;
const INT_PIN_CFG: u8 = 0x37;
const INT_ENABLE: u8 = 0x38;
pub(crate) const ACCEL_XOUT_H: u8 = 0x3B;
const SIGNAL_PATH_RESET: u8 = 0x68;
pub(crate) const USER_CTRL: u8 = 0x6A;
const PWR_MGMT_1: u8 = 0x6B;
const PWR_MGMT_2: u8 = 0x6C;
const I2C_IF: u8 = 0x70;
const WHO_AM_I: u8 = 0x75;

/// Bit of USER_CTRL that switches I2C off. Not read back, since some parts then clear it.
pub(crate) const I2C_IF_DIS: u8 = 0x10;
/// Length of specific force, temperature and rates \[bytes\].
pub(crate) const LENGTH: usize = 14;
const RAD_S_PER_LSB: f32 = 2000.0 / 32768.0 * core::f32::consts::PI / 180.0;
const M_S2_PER_LSB: f32 = 16.0 / 32768.0 * 9.806_65;

/// Returns the step if it applies, or else a step that does nothing.
const fn only(applies: bool, step: ScriptStep) -> ScriptStep {
    if applies { step } else { ScriptStep::Wait(0) }
}

impl<const IDENTITY: u8> Mpu<IDENTITY> {
    const IS_6000: bool = IDENTITY == 0x68;
    const IS_20602: bool = IDENTITY == 0x12;
    const IS_20608: bool = IDENTITY == 0xAF;
    const IS_ICM: bool = Self::IS_20602 || Self::IS_20608 || IDENTITY == 0x98;
    const I2C_OFF: ScriptStep =
        if Self::IS_20602 { ScriptStep::Write(I2C_IF, 0x40) } else { ScriptStep::Write(USER_CTRL, I2C_IF_DIS) };
    /// Scale of the thermometer \[1/K\], and the temperature at which it reads 0 \[degrees C\].
    const THERMOMETER: (f32, f32) = match IDENTITY {
        0x68 => (340.0, 36.53),
        0x70 | 0x71 => (333.87, 21.0),
        _ => (326.8, 25.0),
    };
}

/// Self-test of MPU-6500 and MPU-9250 (AN-MPU-9250A-03): 250 deg/s and 2 g with the filters of 92 Hz, all six axes at
/// once.
const SELF_TEST: SelfTest<InertialReading> = SelfTest {
    quiet: &[
        ScriptStep::Write(CONFIG, 2),
        ScriptStep::Write(ACCEL_CONFIG_2, 2),
        ScriptStep::Write(GYRO_CONFIG, 0),
        ScriptStep::Write(ACCEL_CONFIG, 0),
        ScriptStep::Wait(20_000),
    ],
    trims: &[(ScriptStep::Wait(0), SELF_TEST_X_GYRO), (ScriptStep::Wait(0), SELF_TEST_X_ACCEL)],
    between: &[],
    stimulated: &[
        ScriptStep::Write(GYRO_CONFIG, 0xE0),
        ScriptStep::Write(ACCEL_CONFIG, 0xE0),
        ScriptStep::Wait(20_000),
    ],
    skipped: 2,
    averaged: 100,
    axes: numbers,
    passes: |response| as_at_the_factory(response, [0.225, 0.675]),
};

/// Self-test of the MPU-6000 as in its register map: 250 deg/s and 8 g. The response must be within 14 % of the
/// factory's, which is stored in five-bit codes.
const SELF_TEST_6000: SelfTest<InertialReading> = SelfTest {
    quiet: &[ScriptStep::Write(GYRO_CONFIG, 0), ScriptStep::Write(ACCEL_CONFIG, 0x10), ScriptStep::Wait(20_000)],
    trims: &[(ScriptStep::Wait(0), SELF_TEST_X), (ScriptStep::Wait(0), SELF_TEST_A)],
    stimulated: &[
        ScriptStep::Write(GYRO_CONFIG, 0xE0),
        ScriptStep::Write(ACCEL_CONFIG, 0xF0),
        ScriptStep::Wait(20_000),
    ],
    passes: within_14_percent,
    ..SELF_TEST
};

fn within_14_percent(response: &SelfTestResponse) -> bool {
    let [[x, y, z], [low, ..]] = response.trims;
    let rate = |trim: u8, sign: f32| expected(trim & 0x1F, sign * 25.0 * 131.0, 1.046);
    // Codes 1 to 31 stand for 0.34 to 0.92 g.
    let force = |trim: u8, low: u8| expected((trim >> 3) & 0x1C | low & 3, 0.34 * 4096.0, 1.033_737);
    let expected = [rate(x, 1.0), rate(y, -1.0), rate(z, 1.0), force(x, low >> 4), force(y, low >> 2), force(z, low)];
    response.change.iter().zip(expected).all(|(change, expected)| {
        // Axes without a factory response are not tested.
        expected.is_none_or(|expected| (change / expected - 1.0).abs() <= 0.14)
    })
}

/// Returns the response for a factory code: `first` for 1, times `factor` for each further step; none for 0.
fn expected(trim: u8, first: f32, factor: f32) -> Option<f32> {
    let steps = trim.checked_sub(1)?;
    Some((0..steps).fold(first, |response, _| response * factor))
}

impl<const IDENTITY: u8> SensorPart for Mpu<IDENTITY> {
    type Reading = InertialReading;
    const NAME: &'static str = match IDENTITY {
        0x68 => "MPU-6000",
        0x70 => "MPU-6500",
        0x71 => "MPU-9250",
        0x12 => "ICM-20602",
        0xAF => "ICM-20608-G",
        0x98 => "ICM-20689",
        _ => unreachable!(), // an unknown identity does not compile
    };
    const SPI: Option<SpiFormat> = {
        let clock_hz = if Self::IS_20602 { 10_000_000 } else { 8_000_000 };
        let clock_hz = if Self::IS_ICM { clock_hz } else { 1_000_000 };
        Some(SpiFormat { read: 0x80, write: 0, dummies: 0, clock_hz })
    };
    const I2C: &'static [u8] = &[];
    const STUCK_AFTER: u32 = 20;
    // The other parts store the factory's responses in other places.
    const SELF_TEST: Option<SelfTest<InertialReading>> = match IDENTITY {
        0x68 => Some(SELF_TEST_6000),
        0x70 | 0x71 => Some(SELF_TEST),
        _ => None,
    };
    const SETUP: &'static [ScriptStep] = &[
        Self::I2C_OFF, // also ends anything that the part may be doing as an I2C master
        ScriptStep::Wait(10_000),
        ScriptStep::Write(PWR_MGMT_1, 0x80), // reset
        ScriptStep::Wait(100_000),
        ScriptStep::Identify(WHO_AM_I, &[IDENTITY]),
        only(!Self::IS_ICM, ScriptStep::Write(SIGNAL_PATH_RESET, 0b111)),
        only(!Self::IS_ICM, ScriptStep::Wait(100_000)),
        Self::I2C_OFF,
        ScriptStep::Set(PWR_MGMT_1, 1), // awake, clocked by the gyroscope
        ScriptStep::Wait(10_000),
        Self::I2C_OFF, // an ICM loses it while asleep
        ScriptStep::Set(PWR_MGMT_2, 0),
        ScriptStep::Set(CONFIG, if Self::IS_6000 { 0 } else { 1 }), // gyroscope filter
        ScriptStep::Set(SMPLRT_DIV, if Self::IS_6000 { 7 } else { 0 }),
        ScriptStep::Set(GYRO_CONFIG, 0x18),  // 2000 deg/s, filtered
        ScriptStep::Set(ACCEL_CONFIG, 0x18), // 16 g
        only(!Self::IS_6000, ScriptStep::Set(ACCEL_CONFIG_2, 1)), // accelerometer filter
        only(Self::IS_20602 || Self::IS_20608, ScriptStep::Set(REGISTER_17, 0xC9)),
        ScriptStep::Set(INT_PIN_CFG, 0), // pulsed, push-pull, active high
        ScriptStep::Set(INT_ENABLE, 1),  // data ready
        ScriptStep::Wait(50_000),        // gyroscope start-up
    ];
    const CYCLE: &'static [ScriptStep] = &[ScriptStep::Ready(2_000), ScriptStep::Read(ACCEL_XOUT_H, LENGTH)];

    fn take(&mut self, _: u8, answer: &[u8]) -> Result<Option<InertialReading>, PartFault> {
        let &[ref force @ .., t1, t0, r5, r4, r3, r2, r1, r0] = answer else { return Err(PartFault::Bus) };
        let force = big(force.try_into().map_err(|_| PartFault::Bus)?);
        let (lsb_per_k, zero_c) = Self::THERMOMETER;
        Ok(Some(InertialReading {
            rates_rad_s: big([r5, r4, r3, r2, r1, r0]) * RAD_S_PER_LSB,
            specific_force_m_s2: force * M_S2_PER_LSB,
            temperature_c: f32::from(i16::from_be_bytes([t1, t0])) / lsb_per_k + zero_c,
        }))
    }
}

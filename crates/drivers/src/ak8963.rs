//! MPU-9250 with the magnetometer AK8963 in its package, over SPI (RM-MPU-9250A, MS1356).
//!
//! [`crate::mpu`] describes the MPU-9250. Its auxiliary I2C master operates the AK8963: every tenth sample it reads the
//! last measurement, then writes CNTL1 for the next. This gives 100 measurements per second of +-4912 uT in 16 bits. A
//! measurement takes 7 to 9 ms, so the field is up to 11 ms older than the reading that contains it. Each measurement
//! is commanded anew, so a magnetometer that was reset recovers by itself.
//!
//! One transfer reads both. [`Mpu9250Reading::magnetic`] reports a magnetometer that is missing, damaged or saturated;
//! this never costs an IMU reading. The magnetometer's sensitivity is read only at set-up.

use crate::bus::SpiFormat;
use crate::mpu::{ACCEL_XOUT_H, I2C_IF_DIS, LENGTH, Mpu9250, USER_CTRL};
use crate::part::{PartFault, ScriptStep, SensorPart};
use crate::reading::{InertialReading, MagneticReading, little};
use nalgebra::Vector3;

/// MPU-9250 with AK8963.
#[derive(Clone, Copy, Debug)]
pub struct Mpu9250Ak8963 {
    /// Sensitivity factors of the magnetometer's axes, or the fault that prevented reading them.
    adjustment: Result<Vector3<f32>, PartFault>,
    last: [u8; MAGNETIC_LENGTH],
    /// Number of readings since the last new measurement of the field.
    age: u32,
}

/// Reading of both parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mpu9250Reading {
    /// Rates, specific force and temperature.
    pub inertial: InertialReading,
    /// New measurement of the field along the IMU's axes, if any, or the magnetometer's fault.
    pub magnetic: Result<Option<MagneticReading>, PartFault>,
}

// Registers of the MPU-9250.
const I2C_MST_CTRL: u8 = 0x24;
const I2C_SLV0_ADDR: u8 = 0x25;
const I2C_SLV0_REG: u8 = 0x26;
const I2C_SLV0_CTRL: u8 = 0x27;
const I2C_SLV1_ADDR: u8 = 0x28;
const I2C_SLV1_REG: u8 = 0x29;
const I2C_SLV1_CTRL: u8 = 0x2A;
const I2C_SLV4_ADDR: u8 = 0x31;
const I2C_SLV4_REG: u8 = 0x32;
const I2C_SLV4_DO: u8 = 0x33;
const I2C_SLV4_CTRL: u8 = 0x34;
const I2C_SLV1_DO: u8 = 0x64;
const I2C_MST_DELAY_CTRL: u8 = 0x67;

/// Bit of USER_CTRL that enables the auxiliary I2C master.
const I2C_MST_EN: u8 = 0x20;
/// Enable bit of I2C_SLVx_CTRL, combined with the number of bytes.
const EN: u8 = 0x80;
/// Read bit of I2C_SLVx_ADDR.
const READ: u8 = 0x80;

// Registers of the AK8963.
const ADDRESS: u8 = 0x0C;
const WIA: u8 = 0x00;
const ST1: u8 = 0x02;
const CNTL1: u8 = 0x0A;
const CNTL2: u8 = 0x0B;
const ASAX: u8 = 0x10;

const IDENTITY: u8 = 0x48;
/// Bit of ST1: new measurement available.
const DRDY: u8 = 0x01;
/// Bits of ST2: magnetic overflow; 16-bit output.
const HOFL: u8 = 0x08;
const BITM: u8 = 0x10;
/// Values of CNTL1, with 16-bit output.
const POWER_DOWN: u8 = 0x10;
const SINGLE: u8 = 0x11;
const FUSE_ROM: u8 = 0x1F;
/// Length of ST1, field and ST2 \[bytes\].
const MAGNETIC_LENGTH: usize = 8;
/// Largest field that the part can measure.
const LSB_MAX: f32 = 32760.0;
const UT_PER_LSB: f32 = 0.15;
/// Number of readings without a new measurement after which the magnetometer is reported as late.
const AGE_MAX: u32 = 100;

/// Joins two scripts; `N` must be the sum of their lengths.
const fn join<const N: usize>(first: &[ScriptStep], second: &[ScriptStep]) -> [ScriptStep; N] {
    let mut all = [ScriptStep::Wait(0); N];
    let (mut places, mut steps, mut others) = (all.as_mut_slice(), first, second);
    while let Some((place, more_places)) = places.split_first_mut() {
        if steps.is_empty() {
            (steps, others) = (others, &[]);
        }
        if let Some((step, more_steps)) = steps.split_first() {
            (*place, steps) = (*step, more_steps);
        }
        places = more_places;
    }
    all
}

/// Set-up of the magnetometer, one register per write: the registers of the auxiliary I2C do not accept blocks.
const MAGNETOMETER: &[ScriptStep] = &[
    ScriptStep::Write(USER_CTRL, I2C_MST_EN | I2C_IF_DIS),
    ScriptStep::Set(I2C_MST_CTRL, 0x1D), // 400 kHz, stop between reads
    // Single writes to the magnetometer: reset, then access to its fuse ROM.
    ScriptStep::Set(I2C_SLV4_ADDR, ADDRESS),
    ScriptStep::Write(I2C_SLV4_REG, CNTL2),
    ScriptStep::Write(I2C_SLV4_DO, 1),
    ScriptStep::Write(I2C_SLV4_CTRL, EN),
    ScriptStep::Wait(5_000),
    ScriptStep::Set(I2C_SLV4_REG, CNTL1),
    ScriptStep::Write(I2C_SLV4_DO, FUSE_ROM),
    ScriptStep::Write(I2C_SLV4_CTRL, EN),
    ScriptStep::Wait(5_000),
    // Reads sensitivity and identity.
    ScriptStep::Write(I2C_SLV0_ADDR, READ | ADDRESS),
    ScriptStep::Write(I2C_SLV0_REG, ASAX),
    ScriptStep::Write(I2C_SLV1_ADDR, READ | ADDRESS),
    ScriptStep::Write(I2C_SLV1_REG, WIA),
    ScriptStep::Write(I2C_SLV0_CTRL, EN | 3),
    ScriptStep::Write(I2C_SLV1_CTRL, EN | 1),
    ScriptStep::Wait(5_000),
    ScriptStep::Read(ACCEL_XOUT_H, LENGTH + 4),
    // Disables both slaves before they are set up anew, since their places among the data registers depend on the order
    // of enabling.
    ScriptStep::Write(I2C_SLV0_CTRL, 0),
    ScriptStep::Write(I2C_SLV1_CTRL, 0),
    ScriptStep::Set(I2C_SLV4_DO, POWER_DOWN),
    ScriptStep::Write(I2C_SLV4_CTRL, EN),
    ScriptStep::Wait(5_000),
    // Every tenth sample reads a measurement and commands the next.
    ScriptStep::Set(I2C_SLV4_CTRL, 9),
    ScriptStep::Set(I2C_MST_DELAY_CTRL, 0b11),
    ScriptStep::Set(I2C_SLV0_ADDR, READ | ADDRESS),
    ScriptStep::Set(I2C_SLV0_REG, ST1),
    ScriptStep::Set(I2C_SLV1_ADDR, ADDRESS),
    ScriptStep::Set(I2C_SLV1_REG, CNTL1),
    ScriptStep::Set(I2C_SLV1_DO, SINGLE),
    // The register is not read back, because the MPU may clear the bit of a slave that does not acknowledge.
    ScriptStep::Write(I2C_SLV0_CTRL, EN | 8),
    ScriptStep::Write(I2C_SLV1_CTRL, EN | 1),
];

impl Default for Mpu9250Ak8963 {
    fn default() -> Self {
        Mpu9250Ak8963 { adjustment: Err(PartFault::Calibration), last: [0; MAGNETIC_LENGTH], age: 0 }
    }
}

impl SensorPart for Mpu9250Ak8963 {
    type Reading = Mpu9250Reading;
    const NAME: &'static str = "MPU-9250 with AK8963";
    const SPI: Option<SpiFormat> = Mpu9250::SPI;
    const I2C: &'static [u8] = &[];
    const STUCK_AFTER: u32 = Mpu9250::STUCK_AFTER;
    const SETUP: &'static [ScriptStep] =
        &join::<{ Mpu9250::SETUP.len() + MAGNETOMETER.len() }>(Mpu9250::SETUP, MAGNETOMETER);
    const CYCLE: &'static [ScriptStep] =
        &[ScriptStep::Ready(2_000), ScriptStep::Read(ACCEL_XOUT_H, LENGTH + MAGNETIC_LENGTH)];

    fn take(&mut self, register: u8, answer: &[u8]) -> Result<Option<Mpu9250Reading>, PartFault> {
        let (inertial, external) = answer.split_at_checked(LENGTH).ok_or(PartFault::Bus)?;
        if let &[x, y, z, identity] = external {
            (self.adjustment, self.age) = (adjustment([x, y, z], identity), 0);
            return Ok(None);
        }
        let external = external.try_into().map_err(|_| PartFault::Bus)?;
        let inertial = Mpu9250 {}.take(register, inertial)?;
        Ok(inertial.map(|inertial| Mpu9250Reading { inertial, magnetic: self.magnetic(external) }))
    }
}

impl Mpu9250Ak8963 {
    /// Takes the last read ST1, field and ST2.
    fn magnetic(&mut self, answer: [u8; MAGNETIC_LENGTH]) -> Result<Option<MagneticReading>, PartFault> {
        let adjustment = self.adjustment?;
        let [st1, field @ .., st2] = answer;
        // The MPU keeps the last measurement until the next, and noise makes two measurements differ.
        let is_new = st1 & DRDY != 0 && answer != self.last;
        (self.last, self.age) = (answer, if is_new { 0 } else { self.age.saturating_add(1) });
        if !is_new {
            return if self.age < AGE_MAX { Ok(None) } else { Err(PartFault::Late) };
        }
        if st2 & BITM == 0 {
            return Err(PartFault::Register(CNTL1));
        }
        let field = little(field);
        if st2 & HOFL != 0 || field.amax() > LSB_MAX {
            return Err(PartFault::Range);
        }
        let field = field.component_mul(&adjustment) * UT_PER_LSB;
        // The magnetometer's x is the IMU's y, its y is the IMU's x, and its z points the opposite way.
        Ok(Some(MagneticReading { field_ut: Vector3::new(field.y, field.x, -field.z) }))
    }
}

/// Returns the sensitivity factors of the axes.
fn adjustment(asa: [u8; 3], identity: u8) -> Result<Vector3<f32>, PartFault> {
    match identity {
        IDENTITY => (),
        0x00 | 0xFF => return Err(PartFault::Silent),
        _ => return Err(PartFault::Identity(identity)),
    }
    if asa.iter().any(|&asa| matches!(asa, 0x00 | 0xFF)) {
        return Err(PartFault::Calibration);
    }
    Ok(Vector3::from(asa).map(|asa| (f32::from(asa) - 128.0) * 0.5 / 128.0 + 1.0))
}

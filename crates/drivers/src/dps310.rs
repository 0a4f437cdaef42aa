//! Infineon DPS310 (data sheet V1.2) and Goertek SPL06-001, over SPI or I2C. Both have the same core and the same
//! identity, so the board must know its part.
//!
//! 300 to 1200 hPa and -40 to 85 degrees C. Pressure at 32 Hz, each the mean of 16 samples (about 0.35 Pa rms);
//! temperature at 8 Hz, the mean of 4 samples. Measuring takes 0.95 s per second, within the 1 s of section 4.4. No
//! further filter. The ready flag is polled; the interrupt is not used. The coefficients have no checksum, so they are
//! read twice.
//!
//! | | DPS310 | SPL06-001 |
//! |---|---|---|
//! | temperature sensor of the coefficients | selected by TMP_COEF_SRCE | the one in the pressure element |
//! | temperature fuses | enabled by five writes, as in Infineon's library | no writes needed |

use crate::bus::SpiFormat;
use crate::part::{PartFault, ScriptStep, SensorPart};
use crate::reading::{PressureReading, in_range};

/// DPS310.
pub type Dps310 = Dps3xx<false>;
/// SPL06-001.
pub type Spl06 = Dps3xx<true>;

/// A DPS310, or an SPL06-001 if `IS_SPL06`.
#[derive(Clone, Copy, Debug, Default)]
pub struct Dps3xx<const IS_SPL06: bool> {
    /// Raw coefficients as last read.
    raw: [u8; COEF_LENGTH],
    /// Decoded coefficients, if two reads agreed.
    coefficients: Option<Dps3xxCoefficients>,
}

/// Coefficients, named as in sections 4.9.1 and 4.9.2.
#[derive(Clone, Copy, Debug)]
struct Dps3xxCoefficients {
    c0: f32,
    c1: f32,
    c00: f32,
    c10: f32,
    c01: f32,
    c11: f32,
    c20: f32,
    c21: f32,
    c30: f32,
}

const PSR_B2: u8 = 0x00;
const PRS_CFG: u8 = 0x06;
const TMP_CFG: u8 = 0x07;
const MEAS_CFG: u8 = 0x08;
const CFG_REG: u8 = 0x09;
const RESET: u8 = 0x0C;
const ID: u8 = 0x0D;
const COEF: u8 = 0x10;
const COEF_SRCE: u8 = 0x28;

const PROD_ID: u8 = 0x10;
const COEF_LENGTH: usize = 18;
/// 32 Hz, 16 samples.
const PRS_CFG_VALUE: u8 = 0x54;
/// 8 Hz, 4 samples.
const TMP_CFG_VALUE: u8 = 0x32;
/// Selects the temperature sensor in the pressure element; in COEF_SRCE, the sensor that the coefficients are for.
const TMP_EXT: u8 = 0x80;
/// Result shift, required for pressures of more than 8 samples.
const P_SHIFT: u8 = 0x04;
const COEF_RDY: u8 = 0x80;
const SENSOR_RDY: u8 = 0x40;
const TMP_RDY: u8 = 0x20;
const PRS_RDY: u8 = 0x10;
/// Continuous measurement of pressure and temperature.
const CONTINUOUS: u8 = 0x07;
const SOFT_RST: u8 = 0x09;
/// Scale factors of table 9 for 16 and for 4 samples.
const KP: f32 = 253_952.0;
const KT: f32 = 3_670_016.0;
const RANGE_PA: [f32; 2] = [30_000.0, 120_000.0];
const RANGE_C: [f32; 2] = [-40.0, 85.0];

const DPS310: &[ScriptStep] = &[
    ScriptStep::Write(RESET, SOFT_RST),
    ScriptStep::Wait(3_000), // no answers before
    ScriptStep::Identify(ID, &[PROD_ID]),
    ScriptStep::Await(MEAS_CFG, COEF_RDY | SENSOR_RDY, COEF_RDY | SENSOR_RDY, 100),
    ScriptStep::Read(COEF, COEF_LENGTH),
    ScriptStep::Read(COEF, COEF_LENGTH),
    // No document describes these writes. Without them, some parts read a wrong temperature.
    ScriptStep::Write(0x0E, 0xA5),
    ScriptStep::Write(0x0F, 0x96),
    ScriptStep::Write(0x62, 0x02),
    ScriptStep::Write(0x0E, 0x00),
    ScriptStep::Write(0x0F, 0x00),
    ScriptStep::Set(PRS_CFG, PRS_CFG_VALUE),
    ScriptStep::SetLike(TMP_CFG, TMP_CFG_VALUE, TMP_EXT, COEF_SRCE),
    ScriptStep::Set(CFG_REG, P_SHIFT),
    ScriptStep::Write(MEAS_CFG, CONTINUOUS), // not `Set`: reads back with flags
    ScriptStep::Await(MEAS_CFG, TMP_RDY, TMP_RDY, 100),
];
const SPL06: &[ScriptStep] = &[
    ScriptStep::Write(RESET, SOFT_RST),
    ScriptStep::Wait(3_000),
    ScriptStep::Identify(ID, &[PROD_ID]),
    ScriptStep::Await(MEAS_CFG, COEF_RDY | SENSOR_RDY, COEF_RDY | SENSOR_RDY, 100),
    ScriptStep::Read(COEF, COEF_LENGTH),
    ScriptStep::Read(COEF, COEF_LENGTH),
    ScriptStep::Set(PRS_CFG, PRS_CFG_VALUE),
    ScriptStep::Set(TMP_CFG, TMP_CFG_VALUE | TMP_EXT),
    ScriptStep::Set(CFG_REG, P_SHIFT),
    ScriptStep::Write(MEAS_CFG, CONTINUOUS),
    ScriptStep::Await(MEAS_CFG, TMP_RDY, TMP_RDY, 100),
];

impl<const IS_SPL06: bool> SensorPart for Dps3xx<IS_SPL06> {
    type Reading = PressureReading;
    const NAME: &'static str = if IS_SPL06 { "SPL06-001" } else { "DPS310" };
    const SPI: Option<SpiFormat> = Some(SpiFormat { read: 0x80, write: 0, dummies: 0, clock_hz: 10_000_000 });
    const I2C: &'static [u8] = &[0x76, 0x77];
    const STUCK_AFTER: u32 = 20;
    const SETUP: &'static [ScriptStep] = if IS_SPL06 { SPL06 } else { DPS310 };
    const CYCLE: &'static [ScriptStep] =
        &[ScriptStep::Wait(28_000), ScriptStep::Await(MEAS_CFG, PRS_RDY, PRS_RDY, 35), ScriptStep::Read(PSR_B2, 6)];

    fn take(&mut self, register: u8, answer: &[u8]) -> Result<Option<PressureReading>, PartFault> {
        if register == COEF {
            let answer = answer.try_into().map_err(|_| PartFault::Bus)?;
            self.coefficients = (self.raw == answer).then(|| Dps3xxCoefficients::new(answer));
            self.raw = answer;
            return Ok(None);
        }
        let &[p2, p1, p0, t2, t1, t0] = answer else { return Err(PartFault::Bus) };
        let coefficients = self.coefficients.ok_or(PartFault::Calibration)?;
        in_range(coefficients.compensate(signed([p2, p1, p0, 0], 24), signed([t2, t1, t0, 0], 24)), RANGE_PA, RANGE_C)
    }
}

impl Dps3xxCoefficients {
    /// Decodes the coefficients, packed as in table 18.
    fn new(raw: [u8; COEF_LENGTH]) -> Self {
        let [b0, b1, b2, b3, b4, b5, b6, b7, b8, b9, b10, b11, b12, b13, b14, b15, b16, b17] = raw;
        Dps3xxCoefficients {
            c0: signed([b0, b1, 0, 0], 12),
            c1: signed([b1 << 4 | b2 >> 4, b2 << 4, 0, 0], 12),
            c00: signed([b3, b4, b5, 0], 20),
            c10: signed([b5 << 4 | b6 >> 4, b6 << 4 | b7 >> 4, b7 << 4, 0], 20),
            c01: signed([b8, b9, 0, 0], 16),
            c11: signed([b10, b11, 0, 0], 16),
            c20: signed([b12, b13, 0, 0], 16),
            c21: signed([b14, b15, 0, 0], 16),
            c30: signed([b16, b17, 0, 0], 16),
        }
    }

    fn compensate(&self, pressure: f32, temperature: f32) -> PressureReading {
        let Dps3xxCoefficients { c0, c1, c00, c10, c01, c11, c20, c21, c30 } = *self;
        let (p, t) = (pressure / KP, temperature / KT);
        PressureReading {
            pressure_pa: c00 + p * (c10 + p * (c20 + p * c30)) + t * (c01 + p * (c11 + p * c21)),
            temperature_c: c0 / 2.0 + c1 * t,
        }
    }
}

/// Returns the two's complement number in the highest `bits` bits of four bytes.
fn signed(bytes: [u8; 4], bits: u32) -> f32 {
    (i32::from_be_bytes(bytes) >> (32 - bits)) as f32
}

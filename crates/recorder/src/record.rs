//! What is recorded.

use afbc_guidance::BatteryReading;
use afbc_onboard::{ControlInputs, Readings, Report};
use afbc_store::RecordName;
use afbc_types::ROTORS_MAX;
use crc::{CRC_32_ISO_HDLC, Crc};
use serde::{Deserialize, Serialize};

/// Version of the format, and of what the records mean.
pub const VERSION: u16 = 1;

const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// A part of the log, in the order of its making.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(clippy::large_enum_variant, reason = "one at a time")]
pub enum Record {
    /// The processor has started.
    Start(StartRecord),
    /// A parameter has this value in the configuration of this number, and in those that follow.
    Parameter {
        /// Number of the configuration, 0 for that of the start.
        configuration: u16,
        /// Its name.
        #[serde(with = "name")]
        name: RecordName,
        /// Its value.
        value: f32,
    },
    /// All parameters are as in the image, in the configuration of this number.
    Restored {
        /// Its number.
        configuration: u16,
    },
    /// What messages have brought, for the tick of this number.
    Inputs {
        /// Number of the tick.
        tick: u32,
        /// What they have brought.
        inputs: ControlInputs,
    },
    /// A tick.
    Tick(TickRecord),
}

/// What was started.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StartRecord {
    /// [`VERSION`] of the writer.
    pub version: u16,
    /// Motors of the vehicle.
    pub rotors: u8,
    /// Parameters in the vehicle's table.
    pub parameters: u16,
}

/// A tick: what it took, and what it gave.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TickRecord {
    /// Number of the tick since power-up.
    pub number: u32,
    /// When it began, since power-up \[us\].
    pub time_us: u64,
    /// True if the clock was not trusted.
    pub clock_failed: bool,
    /// What the sensors had read.
    pub readings: Readings,
    /// The battery, if it was measured.
    pub battery: Option<BatteryReading>,
    /// Number of the configuration that is flown from this tick on, if it is another.
    pub adopted: Option<u16>,
    /// What it gave.
    pub given: Given,
}

/// What a tick gave.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Given {
    /// The motors' throttles: 0, or 48 to 2047.
    pub throttles: [u16; ROTORS_MAX],
    /// CRC-32 of mode, estimate and rotor speeds.
    pub digest: u32,
}

impl Given {
    /// Returns what a report says.
    pub fn of<const N: usize>(report: &Report<N>) -> Self {
        let mut throttles = [0; ROTORS_MAX];
        throttles.iter_mut().zip(report.throttles).for_each(|(to, from)| *to = from);
        let mut digest = CRC.digest();
        digest.update(&[report.mode as u8, u8::from(report.estimate.is_some())]);
        for state in report.estimate.iter() {
            let vectors = [&state.position_m, &state.velocity_m_s, &state.attitude_rad, &state.rates_rad_s];
            vectors.into_iter().flatten().for_each(|value| digest.update(&value.to_le_bytes()));
        }
        report.motors.padded().0.iter().for_each(|speed| digest.update(&speed.to_le_bytes()));
        Given { throttles, digest: digest.finalize() }
    }
}

/// A parameter's name as text.
mod name {
    use afbc_store::RecordName;
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serializer};

    pub(super) fn serialize<S: Serializer>(name: &RecordName, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(name.as_str())
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<RecordName, D::Error> {
        RecordName::new(<&str>::deserialize(from)?).ok_or_else(|| D::Error::custom("no name of a parameter"))
    }
}

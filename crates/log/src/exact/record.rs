//! What is recorded.

use afbc_onboard::parameters::ParameterTable;
use afbc_onboard::{ControlInputs, Report, TickInputs};
use afbc_store::RecordName;
use afbc_types::ROTORS_MAX;
use crc::{CRC_32_ISO_HDLC, Crc};
use heapless::String;
use serde::{Deserialize, Serialize};

/// Version of the format, and of what the records mean.
pub const VERSION: u16 = 5;

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
    /// A tick: what it took, and what it gave.
    Tick(TickInputs, Given),
}

/// Longest name of a vehicle, or of a law, that is written; of a longer one the beginning is \[bytes\].
pub const WORD_MAX: usize = 24;

/// What was started.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StartRecord {
    /// [`VERSION`] of the writer. First, so that a reader of another version can say which one it is.
    pub version: u16,
    /// Motors of the vehicle.
    pub rotors: u8,
    /// Parameters in the vehicle's table.
    pub parameters: u16,
    /// CRC-32 of their values at the start, and of the places of the rotors.
    pub digest: u32,
    /// Name of the vehicle, or its beginning.
    pub vehicle: String<WORD_MAX>,
    /// Name of the law, or its beginning.
    pub law: String<WORD_MAX>,
}

impl StartRecord {
    /// Returns the start of a vehicle with these names and parameters.
    pub fn of<const N: usize>(vehicle: &str, law: &str, table: &ParameterTable<N>) -> Self {
        let mut digest = CRC.digest();
        table.iter().for_each(|parameter| digest.update(&parameter.value.to_le_bytes()));
        for rotor in &table.configuration().airframe.rotors {
            digest.update(&rotor.x.to_le_bytes());
            digest.update(&rotor.y.to_le_bytes());
            digest.update(&[u8::from(rotor.pushes_left)]);
        }
        StartRecord {
            version: VERSION,
            rotors: u8::try_from(N).unwrap_or(u8::MAX),
            parameters: table.count(),
            digest: digest.finalize(),
            vehicle: word(vehicle),
            law: word(law),
        }
    }
}

/// Returns as much of a text as is written.
fn word(text: &str) -> String<WORD_MAX> {
    let mut word = String::new();
    let _ = text.chars().try_for_each(|letter| word.push(letter));
    word
}

/// What a tick gave.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Given {
    /// The motors' throttles: 0, or 48 to 2047.
    pub throttles: [u16; ROTORS_MAX],
    /// Number of the flight core's mode.
    pub mode: u8,
    /// Half of the CRC-32 of the estimate.
    pub estimate: u16,
    /// Half of the CRC-32 of the rotor speeds.
    pub speeds: u16,
}

impl Given {
    /// Returns what a report says.
    pub fn of<const N: usize>(report: &Report<N>) -> Self {
        let mut throttles = [0; ROTORS_MAX];
        throttles.iter_mut().zip(report.throttles).for_each(|(to, from)| *to = from);
        let state = report.estimate.as_ref();
        let vectors =
            state.map(|state| [&state.position_m, &state.velocity_m_s, &state.attitude_rad, &state.rates_rad_s]);
        let estimate = half_crc(vectors.into_iter().flatten().flatten());
        let speeds = half_crc(report.motors.padded().0.iter());
        Given { throttles, mode: report.mode as u8, estimate, speeds }
    }
}

/// Returns the lower half of the CRC-32 of these values.
fn half_crc<'a>(values: impl Iterator<Item = &'a f32>) -> u16 {
    let mut digest = CRC.digest();
    values.for_each(|value| digest.update(&value.to_le_bytes()));
    digest.finalize() as u16
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

//! Defines the records of the exact log.

use afbc_onboard::parameters::ParameterTable;
use afbc_onboard::{ControlInputs, Report, TickInputs};
use afbc_store::RecordName;
use afbc_types::ROTORS_MAX;
use crc::{CRC_32_ISO_HDLC, Crc};
use heapless::String;
use serde::{Deserialize, Serialize};

/// Version of the record format and of the records' meaning.
pub const VERSION: u16 = 5;

const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// One record of the log. Records are in the order in which they were made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(clippy::large_enum_variant, reason = "one at a time")]
pub enum Record {
    /// The processor has started.
    Start(StartRecord),
    /// A parameter's value in this configuration and all later ones.
    Parameter {
        /// Number of the configuration; 0 is the configuration at the start.
        configuration: u16,
        /// Name of the parameter.
        #[serde(with = "name")]
        name: RecordName,
        /// Value of the parameter.
        value: f32,
    },
    /// From this configuration on, all parameters have the values of the firmware image.
    Restored {
        /// Number of the configuration.
        configuration: u16,
    },
    /// Inputs that messages brought for a tick.
    Inputs {
        /// Number of the tick.
        tick: u32,
        /// The inputs.
        inputs: ControlInputs,
    },
    /// A tick: its inputs and its outputs.
    Tick(TickInputs, Given),
}

/// Longest name of a vehicle or law in a record \[bytes\]. A longer name is cut off.
pub const WORD_MAX: usize = 24;

/// Identifies the vehicle, the law and the parameters at the start of a log.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StartRecord {
    /// [`VERSION`] of the writer. It is the first field, so that readers of any version can find it.
    pub version: u16,
    /// Number of the vehicle's motors.
    pub rotors: u8,
    /// Number of parameters in the vehicle's table.
    pub parameters: u16,
    /// CRC-32 of the parameter values at the start and of the rotors' positions and directions of rotation.
    pub digest: u32,
    /// Name of the vehicle, perhaps cut off.
    pub vehicle: String<WORD_MAX>,
    /// Name of the law, perhaps cut off.
    pub law: String<WORD_MAX>,
}

impl StartRecord {
    /// Returns the start record of a vehicle with these names and parameters.
    pub fn of(vehicle: &str, law: &str, table: &ParameterTable) -> Self {
        let mut digest = CRC.digest();
        table.iter().for_each(|parameter| digest.update(&parameter.value.to_le_bytes()));
        let rotors = &table.configuration().rotors;
        for rotor in rotors.iter() {
            digest.update(&rotor.x.to_le_bytes());
            digest.update(&rotor.y.to_le_bytes());
            digest.update(&[u8::from(rotor.pushes_left)]);
        }
        StartRecord {
            version: VERSION,
            rotors: rotors.count() as u8,
            parameters: table.count(),
            digest: digest.finalize(),
            vehicle: word(vehicle),
            law: word(law),
        }
    }
}

/// Returns the text, shortened to the whole letters that fit.
fn word(text: &str) -> String<WORD_MAX> {
    let mut word = String::new();
    let _ = text.chars().try_for_each(|letter| word.push(letter));
    word
}

/// Outputs of a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Given {
    /// DSHOT throttles of the motors: 0, or 48 to 2047.
    pub throttles: [u16; ROTORS_MAX],
    /// Number of the flight core's mode.
    pub mode: u8,
    /// Lower half of the CRC-32 of the estimated state.
    pub estimate: u16,
    /// Lower half of the CRC-32 of the commanded rotor speeds.
    pub speeds: u16,
}

impl Given {
    /// Returns the outputs that a report contains.
    pub fn of(report: &Report) -> Self {
        let state = report.estimate.as_ref();
        let vectors =
            state.map(|state| [&state.position_m, &state.velocity_m_s, &state.attitude_rad, &state.rates_rad_s]);
        let estimate = half_crc(vectors.into_iter().flatten().flatten());
        let speeds = half_crc(report.motors.0.iter());
        Given { throttles: report.throttles, mode: report.mode as u8, estimate, speeds }
    }
}

/// Returns the lower half of the CRC-32 of these values.
fn half_crc<'a>(values: impl Iterator<Item = &'a f32>) -> u16 {
    let mut digest = CRC.digest();
    values.for_each(|value| digest.update(&value.to_le_bytes()));
    digest.finalize() as u16
}

/// Serializes a parameter's name as text.
mod name {
    use afbc_store::RecordName;
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serializer};

    pub(super) fn serialize<S: Serializer>(name: &RecordName, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(name.as_str())
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<RecordName, D::Error> {
        RecordName::new(<&str>::deserialize(from)?)
            .ok_or_else(|| D::Error::custom("the record has no valid parameter name"))
    }
}

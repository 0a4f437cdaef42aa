//! Motor controllers, four in a message.

use crate::message::{MessageFormat, PAYLOAD_MAX};
use crate::wire::Layout;
use mavlink::MessageData;
use mavlink::dialects::common::{ESC_INFO_DATA, ESC_STATUS_DATA};

/// Motor controllers of a message.
pub const ESCS_PER_MESSAGE: usize = 4;

/// ESC_STATUS (291): what four motor controllers measure.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EscStatus {
    /// Number of the first of them, from 0.
    pub first: u8,
    /// Time since power-up \[us\].
    pub time_us: u64,
    /// Speed of each motor \[rev/min\].
    pub speeds_rpm: [i32; ESCS_PER_MESSAGE],
    /// Voltage of each \[V\].
    pub voltages_v: [f32; ESCS_PER_MESSAGE],
    /// Current of each \[A\].
    pub currents_a: [f32; ESCS_PER_MESSAGE],
}

/// ESC_INFO (290): how four motor controllers are, without their counts of errors, which are sent as 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EscInfo {
    /// Number of the first of them, from 0.
    pub first: u8,
    /// Time since power-up \[us\].
    pub time_us: u64,
    /// Number of answers since power-up, modulo 65,536.
    pub counter: u16,
    /// Number of motor controllers of the vehicle.
    pub count: u8,
    /// A bit for each of the vehicle's that answers.
    pub online: u8,
    /// `ESC_FAILURE_FLAGS` of each.
    pub failures: [u16; ESCS_PER_MESSAGE],
    /// Temperature of each; `i16::MAX` if unknown \[0.01 deg C\].
    pub temperatures_cc: [i16; ESCS_PER_MESSAGE],
}

/// `ESC_CONNECTION_TYPE_DSHOT`.
const DSHOT: u8 = 5;

/// Time, speeds, voltages, currents, index.
type StatusFields = (u64, [i32; ESCS_PER_MESSAGE], [f32; ESCS_PER_MESSAGE], [f32; ESCS_PER_MESSAGE], u8);
const STATUS: Layout<ESC_STATUS_DATA, StatusFields> = Layout::NEW;
/// Time; errors; counter; failures, temperatures; index, count, connection, flags.
type InfoFields = (u64, [u32; ESCS_PER_MESSAGE], u16, [u16; ESCS_PER_MESSAGE], [i16; ESCS_PER_MESSAGE], [u8; 4]);
const INFO: Layout<ESC_INFO_DATA, InfoFields> = Layout::NEW;

pub(super) fn format(id: u32) -> Option<MessageFormat> {
    Some(match id {
        ESC_STATUS_DATA::ID => STATUS.format(),
        ESC_INFO_DATA::ID => INFO.format(),
        _ => return None,
    })
}

impl EscStatus {
    pub(super) fn read(payload: &[u8]) -> Self {
        let (time_us, speeds_rpm, voltages_v, currents_a, first) = STATUS.read(payload);
        EscStatus { first, time_us, speeds_rpm, voltages_v, currents_a }
    }

    pub(super) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        let EscStatus { first, time_us, speeds_rpm, voltages_v, currents_a } = *self;
        STATUS.write(&(time_us, speeds_rpm, voltages_v, currents_a, first), payload)
    }
}

impl EscInfo {
    pub(super) fn read(payload: &[u8]) -> Self {
        let (time_us, _, counter, failures, temperatures_cc, [first, count, _, online]) = INFO.read(payload);
        EscInfo { first, time_us, counter, count, online, failures, temperatures_cc }
    }

    pub(super) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        let EscInfo { first, time_us, counter, count, online, failures, temperatures_cc } = *self;
        let bytes = [first, count, DSHOT, online];
        INFO.write(&(time_us, [0; ESCS_PER_MESSAGE], counter, failures, temperatures_cc, bytes), payload)
    }
}

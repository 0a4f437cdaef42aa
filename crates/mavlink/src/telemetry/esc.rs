//! ESC telemetry, four ESCs per message.

use crate::message::{MessageFormat, PAYLOAD_MAX};
use crate::wire::MessageLayout;
use mavlink::MessageData;
use mavlink::dialects::common::{ESC_INFO_DATA, ESC_STATUS_DATA};

/// Number of ESCs per message.
pub const ESCS_PER_MESSAGE: usize = 4;

/// ESC_STATUS (291): measurements of four ESCs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EscStatus {
    /// Index of the message's first ESC, from 0.
    pub first: u8,
    /// Time since power-up \[us\].
    pub time_us: u64,
    /// Speed of each motor \[rev/min\].
    pub speeds_rpm: [i32; ESCS_PER_MESSAGE],
    /// Voltage of each ESC \[V\].
    pub voltages_v: [f32; ESCS_PER_MESSAGE],
    /// Current of each ESC \[A\].
    pub currents_a: [f32; ESCS_PER_MESSAGE],
}

/// ESC_INFO (290): condition of four ESCs. Error counts are always sent as 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EscInfo {
    /// Index of the message's first ESC, from 0.
    pub first: u8,
    /// Time since power-up \[us\].
    pub time_us: u64,
    /// Number of answers from ESCs since power-up, modulo 65,536.
    pub counter: u16,
    /// Number of ESCs of the vehicle.
    pub count: u8,
    /// One bit for each of the vehicle's ESCs, set if it answers.
    pub online: u8,
    /// `ESC_FAILURE_FLAGS` of each ESC.
    pub failures: [u16; ESCS_PER_MESSAGE],
    /// Temperature of each ESC; `i16::MAX` if unknown \[0.01 deg C\].
    pub temperatures_cc: [i16; ESCS_PER_MESSAGE],
}

/// `ESC_CONNECTION_TYPE_DSHOT`.
const DSHOT: u8 = 5;

/// Fields: time, speeds, voltages, currents, index of the first ESC.
type StatusFields = (u64, [i32; ESCS_PER_MESSAGE], [f32; ESCS_PER_MESSAGE], [f32; ESCS_PER_MESSAGE], u8);
const STATUS: MessageLayout<ESC_STATUS_DATA, StatusFields> = MessageLayout::NEW;
/// Fields: time; error counts; counter; failures, temperatures; index of the first ESC, number of ESCs, connection
/// type, online bits.
type InfoFields = (u64, [u32; ESCS_PER_MESSAGE], u16, [u16; ESCS_PER_MESSAGE], [i16; ESCS_PER_MESSAGE], [u8; 4]);
const INFO: MessageLayout<ESC_INFO_DATA, InfoFields> = MessageLayout::NEW;

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

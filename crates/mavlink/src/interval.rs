//! Message rates: MESSAGE_INTERVAL, and the older REQUEST_DATA_STREAM with DATA_STREAM.

use crate::address::Address;
use crate::message::{MessageFormat, PAYLOAD_MAX};
use crate::wire::MessageLayout;
use mavlink::dialects::common::{DATA_STREAM_DATA, MESSAGE_INTERVAL_DATA, REQUEST_DATA_STREAM_DATA};

/// MESSAGE_INTERVAL (244).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MessageInterval {
    /// Id of the message.
    pub message: u32,
    /// Interval; -1: never, 0: not available \[us\].
    pub interval_us: i32,
}

/// REQUEST_DATA_STREAM (66) or its answer DATA_STREAM (67): rate of a group of messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DataStream {
    /// `MAV_DATA_STREAM`.
    pub group: u8,
    /// Rate; 0 for none \[Hz\].
    pub rate_hz: u16,
}

const INTERVAL: MessageLayout<MESSAGE_INTERVAL_DATA, (i32, u16)> = MessageLayout::NEW;
/// Fields: rate, receiver, group, start.
const STREAM: MessageLayout<REQUEST_DATA_STREAM_DATA, (u16, Address, u8, u8)> = MessageLayout::NEW;

/// Fields: rate, group, on.
const GROUP: MessageLayout<DATA_STREAM_DATA, (u16, u8, u8)> = MessageLayout::NEW;

impl MessageInterval {
    pub(crate) fn format() -> MessageFormat {
        INTERVAL.format()
    }

    pub(crate) fn read(payload: &[u8]) -> Self {
        let (interval_us, message) = INTERVAL.read(payload);
        MessageInterval { message: message.into(), interval_us }
    }

    pub(crate) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        INTERVAL.write(&(self.interval_us, self.message as u16), payload)
    }
}

impl DataStream {
    pub(crate) fn format() -> MessageFormat {
        STREAM.format()
    }

    /// Returns the message and its receiver.
    pub(crate) fn read(payload: &[u8]) -> (Self, Address) {
        let (rate_hz, to, group, start) = STREAM.read(payload);
        (DataStream { group, rate_hz: if start == 0 { 0 } else { rate_hz } }, to)
    }

    pub(crate) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        STREAM.write(&(self.rate_hz, Address::default(), self.group, u8::from(self.rate_hz > 0)), payload)
    }

    pub(crate) fn answer_format() -> MessageFormat {
        GROUP.format()
    }

    pub(crate) fn read_answer(payload: &[u8]) -> Self {
        let (rate_hz, group, on) = GROUP.read(payload);
        DataStream { group, rate_hz: if on == 0 { 0 } else { rate_hz } }
    }

    pub(crate) fn write_answer(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        GROUP.write(&(self.rate_hz, self.group, u8::from(self.rate_hz > 0)), payload)
    }
}

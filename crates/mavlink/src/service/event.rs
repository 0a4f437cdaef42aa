//! Events: REQUEST_EVENT and RESPONSE_EVENT_ERROR.

use crate::address::Address;
use crate::message::{MessageFormat, PAYLOAD_MAX};
use crate::wire::MessageLayout;
use mavlink::MessageData;
use mavlink::dialects::common::{REQUEST_EVENT_DATA, RESPONSE_EVENT_ERROR_DATA};

/// REQUEST_EVENT (412): a ground station requests events that it has missed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EventRequest {
    /// Sequence numbers of the first and the last event.
    pub numbers: [u16; 2],
}

/// RESPONSE_EVENT_ERROR (413).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EventError {
    /// Sequence number of the event.
    pub number: u16,
    /// Sequence number of the oldest available event.
    pub oldest: u16,
    /// `MAV_EVENT_ERROR_REASON`: 0, no longer available.
    pub reason: u8,
}

pub(super) const REQUEST_ID: u32 = REQUEST_EVENT_DATA::ID;
pub(super) const ERROR_ID: u32 = RESPONSE_EVENT_ERROR_DATA::ID;

const REQUEST: MessageLayout<REQUEST_EVENT_DATA, ([u16; 2], Address)> = MessageLayout::NEW;
const ERROR: MessageLayout<RESPONSE_EVENT_ERROR_DATA, (u16, u16, Address, u8)> = MessageLayout::NEW;

impl EventRequest {
    pub(super) fn format() -> MessageFormat {
        REQUEST.format()
    }

    pub(super) fn read(payload: &[u8]) -> (Self, Address) {
        let (numbers, to) = REQUEST.read(payload);
        (EventRequest { numbers }, to)
    }

    pub(super) fn write(self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        REQUEST.write(&(self.numbers, Address::default()), payload)
    }
}

impl EventError {
    pub(super) fn format() -> MessageFormat {
        ERROR.format()
    }

    pub(super) fn read(payload: &[u8]) -> (Self, Address) {
        let (number, oldest, to, reason) = ERROR.read(payload);
        (EventError { number, oldest, reason }, to)
    }

    pub(super) fn write(self, to: Address, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        let EventError { number, oldest, reason } = self;
        ERROR.write(&(number, oldest, to, reason), payload)
    }
}

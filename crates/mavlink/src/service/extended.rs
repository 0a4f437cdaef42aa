//! Extended parameters, which cameras have: PARAM_EXT_REQUEST_READ, PARAM_EXT_REQUEST_LIST and PARAM_EXT_SET, with
//! PARAM_EXT_VALUE and PARAM_EXT_ACK. Their values are ignored.

use crate::address::Address;
use crate::message::{MessageFormat, PAYLOAD_MAX};
use crate::wire::{MessageLayout, Unused};
use mavlink::MessageData;
use mavlink::dialects::common::{
    PARAM_EXT_ACK_DATA, PARAM_EXT_REQUEST_LIST_DATA, PARAM_EXT_REQUEST_READ_DATA, PARAM_EXT_SET_DATA,
    PARAM_EXT_VALUE_DATA,
};

/// Name of an extended parameter, padded with zeros; at full length there are none.
pub type ExtendedName = [u8; 16];

/// Request about extended parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExtendedRequest {
    /// PARAM_EXT_REQUEST_LIST (321).
    List,
    /// PARAM_EXT_REQUEST_READ (320).
    Read {
        /// Name.
        name: ExtendedName,
        /// Index in the list; -1 if the name counts.
        place: i16,
    },
    /// PARAM_EXT_SET (323).
    Set {
        /// Name.
        name: ExtendedName,
        /// `MAV_PARAM_EXT_TYPE`.
        kind: u8,
    },
}

/// Answer about extended parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExtendedAnswer {
    /// PARAM_EXT_VALUE (322).
    Value {
        /// Name.
        name: ExtendedName,
        /// `MAV_PARAM_EXT_TYPE`.
        kind: u8,
        /// Number of parameters.
        count: u16,
        /// Index in the list; `u16::MAX` for none.
        place: u16,
    },
    /// PARAM_EXT_ACK (324).
    Ack {
        /// Name.
        name: ExtendedName,
        /// `MAV_PARAM_EXT_TYPE`.
        kind: u8,
        /// `PARAM_ACK`: 0 set, 1 unsupported, 2 failed, 3 in progress.
        result: u8,
    },
}

pub(super) const READ_ID: u32 = PARAM_EXT_REQUEST_READ_DATA::ID;
pub(super) const LIST_ID: u32 = PARAM_EXT_REQUEST_LIST_DATA::ID;
pub(super) const SET_ID: u32 = PARAM_EXT_SET_DATA::ID;
pub(super) const VALUE_ID: u32 = PARAM_EXT_VALUE_DATA::ID;
pub(super) const ACK_ID: u32 = PARAM_EXT_ACK_DATA::ID;

/// Value of a parameter.
type ExtendedValue = Unused<128>;

const READ: MessageLayout<PARAM_EXT_REQUEST_READ_DATA, (i16, Address, ExtendedName)> = MessageLayout::NEW;
const LIST: MessageLayout<PARAM_EXT_REQUEST_LIST_DATA, (Address,)> = MessageLayout::NEW;
const SET: MessageLayout<PARAM_EXT_SET_DATA, (Address, ExtendedName, ExtendedValue, u8)> = MessageLayout::NEW;
const VALUE: MessageLayout<PARAM_EXT_VALUE_DATA, (u16, u16, ExtendedName, ExtendedValue, u8)> = MessageLayout::NEW;
const ACK: MessageLayout<PARAM_EXT_ACK_DATA, (ExtendedName, ExtendedValue, u8, u8)> = MessageLayout::NEW;

impl ExtendedRequest {
    pub(super) fn format(id: u32) -> Option<MessageFormat> {
        Some(match id {
            READ_ID => READ.format(),
            LIST_ID => LIST.format(),
            _ => SET.format(),
        })
    }

    pub(super) fn read(id: u32, payload: &[u8]) -> (Self, Address) {
        match id {
            READ_ID => {
                let (place, to, name) = READ.read(payload);
                (ExtendedRequest::Read { name, place }, to)
            }
            LIST_ID => (ExtendedRequest::List, LIST.read(payload).0),
            _ => {
                let (to, name, _, kind) = SET.read(payload);
                (ExtendedRequest::Set { name, kind }, to)
            }
        }
    }

    pub(super) fn write(self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        let to = Address::default();
        match self {
            ExtendedRequest::List => LIST.write(&(to,), payload),
            ExtendedRequest::Read { name, place } => READ.write(&(place, to, name), payload),
            ExtendedRequest::Set { name, kind } => SET.write(&(to, name, Unused, kind), payload),
        }
    }
}

impl ExtendedAnswer {
    pub(super) fn format(id: u32) -> Option<MessageFormat> {
        Some(if id == VALUE_ID { VALUE.format() } else { ACK.format() })
    }

    pub(super) fn read(id: u32, payload: &[u8]) -> Self {
        if id == VALUE_ID {
            let (count, place, name, _, kind) = VALUE.read(payload);
            ExtendedAnswer::Value { name, kind, count, place }
        } else {
            let (name, _, kind, result) = ACK.read(payload);
            ExtendedAnswer::Ack { name, kind, result }
        }
    }

    pub(super) fn write(self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        match self {
            ExtendedAnswer::Value { name, kind, count, place } => {
                VALUE.write(&(count, place, name, Unused, kind), payload)
            }
            ExtendedAnswer::Ack { name, kind, result } => ACK.write(&(name, Unused, kind, result), payload),
        }
    }
}

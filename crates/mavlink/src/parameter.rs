//! Parameter protocol, in both directions.

use crate::address::Address;
use crate::message::{FrameFault, MessageFormat, PAYLOAD_MAX};
use crate::wire::MessageLayout;
use mavlink::MessageData;
use mavlink::dialects::common::{
    MavParamType, PARAM_ERROR_DATA, PARAM_REQUEST_LIST_DATA, PARAM_REQUEST_READ_DATA, PARAM_SET_DATA, PARAM_VALUE_DATA,
};

/// Name of a parameter, padded with zeros; at full length there are none.
pub type ParameterName = [u8; 16];

/// A ground station's message about parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParameterRequest {
    /// PARAM_REQUEST_LIST (21).
    List,
    /// PARAM_REQUEST_READ (20) by index.
    ReadIndex(u16),
    /// PARAM_REQUEST_READ (20) by name.
    ReadName(ParameterName),
    /// PARAM_SET (23).
    Set {
        /// Name.
        name: ParameterName,
        /// The four bytes of the value.
        value: [u8; 4],
        /// `MAV_PARAM_TYPE`.
        kind: u8,
    },
}

/// PARAM_VALUE (22).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ParameterValue {
    /// Name.
    pub name: ParameterName,
    /// The four bytes of the value.
    pub value: [u8; 4],
    /// `MAV_PARAM_TYPE`.
    pub kind: u8,
    /// Number of parameters.
    pub count: u16,
    /// Index in the list; `u16::MAX` for none.
    pub index: u16,
}

/// PARAM_ERROR (345).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ParameterError {
    /// Requested name, or zeros.
    pub name: ParameterName,
    /// Requested index; -1 for none.
    pub index: i16,
    /// `MAV_PARAM_ERROR`.
    pub error: u8,
}

const ERROR: MessageLayout<PARAM_ERROR_DATA, (i16, Address, ParameterName, u8)> = MessageLayout::NEW;
const LIST: MessageLayout<PARAM_REQUEST_LIST_DATA, (Address,)> = MessageLayout::NEW;
const READ: MessageLayout<PARAM_REQUEST_READ_DATA, (i16, Address, ParameterName)> = MessageLayout::NEW;
const SET: MessageLayout<PARAM_SET_DATA, ([u8; 4], Address, ParameterName, u8)> = MessageLayout::NEW;
const VALUE: MessageLayout<PARAM_VALUE_DATA, ([u8; 4], u16, u16, ParameterName, u8)> = MessageLayout::NEW;

impl ParameterRequest {
    /// Sets a parameter, of whose name at most 16 letters count, to a number, which is understood for whole ones, too.
    pub fn set(name: &str, value: f32) -> Self {
        let mut letters = [0; 16];
        letters.iter_mut().zip(name.bytes()).for_each(|(to, from)| *to = from);
        let kind = MavParamType::MAV_PARAM_TYPE_REAL32 as u8;
        ParameterRequest::Set { name: letters, value: value.to_le_bytes(), kind }
    }

    pub(crate) fn format(id: u32) -> Option<MessageFormat> {
        Some(match id {
            PARAM_REQUEST_LIST_DATA::ID => LIST.format(),
            PARAM_REQUEST_READ_DATA::ID => READ.format(),
            PARAM_SET_DATA::ID => SET.format(),
            _ => return None,
        })
    }

    /// Returns the message and its receiver.
    pub(crate) fn read(id: u32, payload: &[u8]) -> Result<(Self, Address), FrameFault> {
        Ok(match id {
            PARAM_REQUEST_LIST_DATA::ID => (ParameterRequest::List, LIST.read(payload).0),
            PARAM_REQUEST_READ_DATA::ID => {
                let (place, to, name) = READ.read(payload);
                // -1 means that the name counts.
                let place = u16::try_from(place).map(ParameterRequest::ReadIndex);
                (place.unwrap_or(ParameterRequest::ReadName(name)), to)
            }
            PARAM_SET_DATA::ID => {
                let (value, to, name, kind) = SET.read(payload);
                (ParameterRequest::Set { name, value, kind }, to)
            }
            _ => return Err(FrameFault::Unknown),
        })
    }

    pub(crate) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        let to = Address::default();
        match *self {
            ParameterRequest::List => LIST.write(&(to,), payload),
            ParameterRequest::ReadIndex(place) => {
                READ.write(&(i16::try_from(place).unwrap_or(i16::MAX), to, [0; 16]), payload)
            }
            ParameterRequest::ReadName(name) => READ.write(&(-1, to, name), payload),
            ParameterRequest::Set { name, value, kind } => SET.write(&(value, to, name, kind), payload),
        }
    }
}

impl ParameterError {
    /// There is no such parameter.
    pub const DOES_NOT_EXIST: u8 = 1;

    pub(crate) fn format() -> MessageFormat {
        ERROR.format()
    }

    /// Returns the message and its receiver.
    pub(crate) fn read(payload: &[u8]) -> (Self, Address) {
        let (place, to, name, error) = ERROR.read(payload);
        (ParameterError { name, index: place, error }, to)
    }

    pub(crate) fn write(&self, to: Address, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        let ParameterError { name, index: place, error } = *self;
        ERROR.write(&(place, to, name, error), payload)
    }
}

impl ParameterValue {
    pub(crate) fn format() -> MessageFormat {
        VALUE.format()
    }

    pub(crate) fn read(payload: &[u8]) -> Self {
        let (value, count, place, name, kind) = VALUE.read(payload);
        ParameterValue { name, value, kind, count, index: place }
    }

    pub(crate) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        let ParameterValue { name, value, kind, count, index: place } = *self;
        VALUE.write(&(value, count, place, name, kind), payload)
    }
}

//! Requests about logs, with the answers of a vehicle without logs. Messages: LOG_REQUEST_LIST, LOG_REQUEST_DATA,
//! LOG_ERASE, LOG_REQUEST_END, LOG_ENTRY, LOG_DATA, LOGGING_ACK.

use crate::address::Address;
use crate::message::{MessageFormat, PAYLOAD_MAX};
use crate::wire::{MessageLayout, Unused};
use mavlink::MessageData;
use mavlink::dialects::common::{
    LOG_DATA_DATA, LOG_ENTRY_DATA, LOG_ERASE_DATA, LOG_REQUEST_DATA_DATA, LOG_REQUEST_END_DATA, LOG_REQUEST_LIST_DATA,
    LOGGING_ACK_DATA,
};

/// Request about logs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LogRequest {
    /// LOG_REQUEST_LIST (117).
    List {
        /// First log id.
        first: u16,
        /// Last log id.
        last: u16,
    },
    /// LOG_REQUEST_DATA (119).
    Data {
        /// Log id.
        log: u16,
        /// Offset of the first byte.
        offset: u32,
        /// Number of bytes.
        bytes: u32,
    },
    /// LOG_ERASE (121): erases all logs. Not answered.
    Erase,
    /// LOG_REQUEST_END (122): ends the transfer. Not answered.
    End,
    /// LOGGING_ACK (268): the part of a streamed log with this sequence number has arrived. Not answered.
    Received(u16),
}

/// Answer about logs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LogAnswer {
    /// LOG_ENTRY (118).
    Entry {
        /// Log id.
        log: u16,
        /// Number of logs, and the last log id.
        logs: [u16; 2],
    },
    /// LOG_DATA (120), without the data.
    Data {
        /// Log id.
        log: u16,
        /// Offset of the first byte.
        offset: u32,
        /// Number of bytes; 0 at the end of the log.
        bytes: u8,
    },
}

pub(super) const LIST_ID: u32 = LOG_REQUEST_LIST_DATA::ID;
pub(super) const DATA_REQUEST_ID: u32 = LOG_REQUEST_DATA_DATA::ID;
pub(super) const ERASE_ID: u32 = LOG_ERASE_DATA::ID;
pub(super) const END_ID: u32 = LOG_REQUEST_END_DATA::ID;
pub(super) const RECEIVED_ID: u32 = LOGGING_ACK_DATA::ID;
pub(super) const ENTRY_ID: u32 = LOG_ENTRY_DATA::ID;
pub(super) const DATA_ID: u32 = LOG_DATA_DATA::ID;

const LIST: MessageLayout<LOG_REQUEST_LIST_DATA, (u16, u16, Address)> = MessageLayout::NEW;
const DATA_REQUEST: MessageLayout<LOG_REQUEST_DATA_DATA, (u32, u32, u16, Address)> = MessageLayout::NEW;
const ERASE: MessageLayout<LOG_ERASE_DATA, (Address,)> = MessageLayout::NEW;
const END: MessageLayout<LOG_REQUEST_END_DATA, (Address,)> = MessageLayout::NEW;
const RECEIVED: MessageLayout<LOGGING_ACK_DATA, (u16, Address)> = MessageLayout::NEW;
/// Fields: time and size; log id; number of logs and last log id.
const ENTRY: MessageLayout<LOG_ENTRY_DATA, (Unused<8>, u16, [u16; 2])> = MessageLayout::NEW;
const DATA: MessageLayout<LOG_DATA_DATA, (u32, u16, u8, Unused<90>)> = MessageLayout::NEW;

impl LogRequest {
    pub(super) fn format(id: u32) -> Option<MessageFormat> {
        Some(match id {
            LIST_ID => LIST.format(),
            DATA_REQUEST_ID => DATA_REQUEST.format(),
            ERASE_ID => ERASE.format(),
            END_ID => END.format(),
            RECEIVED_ID => RECEIVED.format(),
            _ => return None,
        })
    }

    pub(super) fn read(id: u32, payload: &[u8]) -> (Self, Address) {
        match id {
            LIST_ID => {
                let (first, last, to) = LIST.read(payload);
                (LogRequest::List { first, last }, to)
            }
            ERASE_ID => (LogRequest::Erase, ERASE.read(payload).0),
            END_ID => (LogRequest::End, END.read(payload).0),
            RECEIVED_ID => {
                let (sequence, to) = RECEIVED.read(payload);
                (LogRequest::Received(sequence), to)
            }
            _ => {
                let (offset, bytes, log, to) = DATA_REQUEST.read(payload);
                (LogRequest::Data { log, offset, bytes }, to)
            }
        }
    }

    pub(super) fn write(self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        let to = Address::default();
        match self {
            LogRequest::List { first, last } => LIST.write(&(first, last, to), payload),
            LogRequest::Data { log, offset, bytes } => DATA_REQUEST.write(&(offset, bytes, log, to), payload),
            LogRequest::Erase => ERASE.write(&(to,), payload),
            LogRequest::End => END.write(&(to,), payload),
            LogRequest::Received(sequence) => RECEIVED.write(&(sequence, to), payload),
        }
    }
}

impl LogAnswer {
    pub(super) fn format(id: u32) -> Option<MessageFormat> {
        Some(if id == ENTRY_ID { ENTRY.format() } else { DATA.format() })
    }

    pub(super) fn read(id: u32, payload: &[u8]) -> Self {
        if id == ENTRY_ID {
            let (_, log, logs) = ENTRY.read(payload);
            LogAnswer::Entry { log, logs }
        } else {
            let (offset, log, bytes, _) = DATA.read(payload);
            LogAnswer::Data { log, offset, bytes }
        }
    }

    pub(super) fn write(self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        match self {
            LogAnswer::Entry { log, logs } => ENTRY.write(&(Unused, log, logs), payload),
            LogAnswer::Data { log, offset, bytes } => DATA.write(&(offset, log, bytes, Unused), payload),
        }
    }
}

//! Logs: LOG_ENTRY and LOG_DATA with their contents.

use crate::address::Address;
use crate::message::{Fault, Message, MessageFormat, PAYLOAD_MAX};
use crate::wire::Layout;
use mavlink::MessageData;
use mavlink::dialects::common::{LOG_DATA_DATA, LOG_ENTRY_DATA};

/// Most bytes in one LOG_DATA.
pub const LOG_DATA_MAX: usize = 90;

/// LOG_ENTRY (118): one of the logs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LogEntry {
    /// Its number, from 0 on.
    pub log: u16,
    /// How many there are.
    pub count: u16,
    /// The last number.
    pub last: u16,
    /// When it was written, since 1970; 0 if that is unknown \[s\].
    pub utc_s: u32,
    /// Its size \[bytes\].
    pub size: u32,
}

/// LOG_DATA (120): a part of a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LogData {
    /// Number of the log.
    pub log: u16,
    /// Offset of the first byte.
    pub offset: u32,
    /// Number of bytes; less than [`LOG_DATA_MAX`] in the last part.
    pub count: u8,
    /// The bytes.
    pub data: [u8; LOG_DATA_MAX],
}

/// Time, size; number, number of logs, last number.
pub(super) const ENTRY: Layout<LOG_ENTRY_DATA, ([u32; 2], [u16; 3])> = Layout::NEW;
pub(super) const DATA: Layout<LOG_DATA_DATA, (u32, u16, u8, [u8; LOG_DATA_MAX])> = Layout::NEW;

impl LogEntry {
    pub(super) fn read(payload: &[u8]) -> Self {
        let ([utc_s, size], [log, count, last]) = ENTRY.read(payload);
        LogEntry { log, count, last, utc_s, size }
    }

    pub(super) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        let LogEntry { log, count, last, utc_s, size } = *self;
        ENTRY.write(&([utc_s, size], [log, count, last]), payload)
    }
}

impl LogData {
    pub(super) fn read(payload: &[u8]) -> Self {
        let (offset, log, count, data) = DATA.read(payload);
        LogData { log, offset, count, data }
    }

    pub(super) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        DATA.write(&(self.offset, self.log, self.count, self.data), payload)
    }
}

/// A message about logs: what a vehicle sends that has logs and no other files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(clippy::large_enum_variant, reason = "one at a time")]
pub enum LogMessage {
    /// One of the logs.
    Entry(LogEntry),
    /// A part of one.
    Data(LogData),
}

impl Message for LogMessage {
    fn format(id: u32) -> Option<MessageFormat> {
        match id {
            LOG_ENTRY_DATA::ID => Some(ENTRY.format()),
            LOG_DATA_DATA::ID => Some(DATA.format()),
            _ => None,
        }
    }

    fn read(id: u32, payload: &[u8], _: Address) -> Result<Self, Fault> {
        match id {
            LOG_ENTRY_DATA::ID => Ok(LogMessage::Entry(LogEntry::read(payload))),
            LOG_DATA_DATA::ID => Ok(LogMessage::Data(LogData::read(payload))),
            _ => Err(Fault::Unknown),
        }
    }

    fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        match self {
            LogMessage::Entry(entry) => entry.write(payload),
            LogMessage::Data(data) => data.write(payload),
        }
    }
}

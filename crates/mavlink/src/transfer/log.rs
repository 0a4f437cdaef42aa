//! Logs with their data: LOG_ENTRY and LOG_DATA.

use crate::address::Address;
use crate::message::{FrameFault, MessageFormat, MessageSet, PAYLOAD_MAX};
use crate::wire::MessageLayout;
use mavlink::MessageData;
use mavlink::dialects::common::{LOG_DATA_DATA, LOG_ENTRY_DATA};

/// Largest number of data bytes in one LOG_DATA.
pub const LOG_DATA_MAX: usize = 90;

/// LOG_ENTRY (118): description of one log.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LogEntry {
    /// Log id, from 0.
    pub log: u16,
    /// Number of logs.
    pub count: u16,
    /// Last log id.
    pub last: u16,
    /// Time of the log since 1970; 0 if unknown \[s\].
    pub utc_s: u32,
    /// Size of the log \[bytes\].
    pub size: u32,
}

/// LOG_DATA (120): a part of a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LogData {
    /// Log id.
    pub log: u16,
    /// Offset of the first byte.
    pub offset: u32,
    /// Number of bytes; fewer than [`LOG_DATA_MAX`] in the last part.
    pub count: u8,
    /// The bytes.
    pub data: [u8; LOG_DATA_MAX],
}

/// Fields: time, size; log id, number of logs, last log id.
pub(super) const ENTRY: MessageLayout<LOG_ENTRY_DATA, ([u32; 2], [u16; 3])> = MessageLayout::NEW;
pub(super) const DATA: MessageLayout<LOG_DATA_DATA, (u32, u16, u8, [u8; LOG_DATA_MAX])> = MessageLayout::NEW;

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

/// A message about logs, for vehicles that have logs but no other files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(clippy::large_enum_variant, reason = "one at a time")]
pub enum LogMessage {
    /// Description of a log.
    Entry(LogEntry),
    /// A part of a log.
    Data(LogData),
}

impl MessageSet for LogMessage {
    fn format(id: u32) -> Option<MessageFormat> {
        match id {
            LOG_ENTRY_DATA::ID => Some(ENTRY.format()),
            LOG_DATA_DATA::ID => Some(DATA.format()),
            _ => None,
        }
    }

    fn read(id: u32, payload: &[u8], _: Address) -> Result<Self, FrameFault> {
        match id {
            LOG_ENTRY_DATA::ID => Ok(LogMessage::Entry(LogEntry::read(payload))),
            LOG_DATA_DATA::ID => Ok(LogMessage::Data(LogData::read(payload))),
            _ => Err(FrameFault::Unknown),
        }
    }

    fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        match self {
            LogMessage::Entry(entry) => entry.write(payload),
            LogMessage::Data(data) => data.write(payload),
        }
    }
}

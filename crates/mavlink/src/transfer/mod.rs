//! Files and logs with their data, from vehicles with storage. They are separate from [`Downlink`](crate::Downlink), so
//! that the messages of a vehicle without storage stay small.

mod component;
mod file;
mod log;
mod stream;

use crate::address::Address;
use crate::message::{FrameFault, MessageFormat, MessageSet, PAYLOAD_MAX};
pub use component::ComponentMetadata;
pub use file::{FILE_DATA_MAX, FileOpcode, FilePacket};
pub use log::{LOG_DATA_MAX, LogData, LogEntry, LogMessage};
use mavlink::MessageData;
use mavlink::dialects::common::{
    COMPONENT_INFORMATION_DATA, COMPONENT_METADATA_DATA, FILE_TRANSFER_PROTOCOL_DATA, LOG_DATA_DATA, LOG_ENTRY_DATA,
    LOGGING_DATA_ACKED_DATA, LOGGING_DATA_DATA,
};
pub use stream::{STREAM_DATA_MAX, StreamedLog};

/// A message with data from storage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(clippy::large_enum_variant, reason = "one at a time, on the stack of whoever sends it")]
pub enum Transfer {
    /// FILE_TRANSFER_PROTOCOL (110).
    File {
        /// The packet.
        packet: FilePacket,
        /// Address of the requester.
        to: Address,
    },
    /// LOG_ENTRY (118) or LOG_DATA (120).
    Log(LogMessage),
    /// LOGGING_DATA (266) or LOGGING_DATA_ACKED (267).
    LogPart(StreamedLog),
    /// COMPONENT_METADATA (397).
    Metadata(ComponentMetadata),
    /// COMPONENT_INFORMATION (395), the predecessor, without metadata of peripherals.
    Information(ComponentMetadata),
}

impl MessageSet for Transfer {
    fn format(id: u32) -> Option<MessageFormat> {
        Some(match id {
            FILE_TRANSFER_PROTOCOL_DATA::ID => file::LAYOUT.format(),
            LOG_ENTRY_DATA::ID | LOG_DATA_DATA::ID => return LogMessage::format(id),
            LOGGING_DATA_DATA::ID => stream::SENT.format(),
            LOGGING_DATA_ACKED_DATA::ID => stream::ACKED.format(),
            COMPONENT_METADATA_DATA::ID => component::METADATA.format(),
            COMPONENT_INFORMATION_DATA::ID => component::INFORMATION.format(),
            _ => return None,
        })
    }

    fn read(id: u32, payload: &[u8], receiver: Address) -> Result<Self, FrameFault> {
        Ok(match id {
            FILE_TRANSFER_PROTOCOL_DATA::ID => {
                let (packet, to) = FilePacket::read(payload);
                Transfer::File { packet, to }
            }
            LOG_ENTRY_DATA::ID | LOG_DATA_DATA::ID => Transfer::Log(LogMessage::read(id, payload, receiver)?),
            LOGGING_DATA_DATA::ID => Transfer::LogPart(StreamedLog::read(payload, false)),
            LOGGING_DATA_ACKED_DATA::ID => Transfer::LogPart(StreamedLog::read(payload, true)),
            COMPONENT_METADATA_DATA::ID => Transfer::Metadata(ComponentMetadata::read(payload)),
            COMPONENT_INFORMATION_DATA::ID => Transfer::Information(ComponentMetadata::read_information(payload)),
            _ => return Err(FrameFault::Unknown),
        })
    }

    fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        match self {
            Transfer::File { packet, to } => packet.write(*to, payload),
            Transfer::Log(message) => message.write(payload),
            Transfer::LogPart(part) => part.write(payload),
            Transfer::Metadata(metadata) => metadata.write(payload),
            Transfer::Information(metadata) => metadata.write_information(payload),
        }
    }
}

//! Requests of FILE_TRANSFER_PROTOCOL (MAVLink FTP) and their refusal.

use crate::address::Address;
use crate::message::{FrameFault, MessageFormat, PAYLOAD_MAX};
use crate::wire::{MessageLayout, Unused};
use mavlink::MessageData;
use mavlink::dialects::common::FILE_TRANSFER_PROTOCOL_DATA;

/// An FTP request without its data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FileOperation {
    /// Sequence number of the request.
    pub sequence: u16,
    /// Session id.
    pub session: u8,
    /// Opcode of the request: `MAV_FTP_OPCODE`, below 128.
    pub operation: u8,
    /// Offset of the first byte.
    pub offset: u32,
}

/// An FTP response that refuses an operation (NAK).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FileRefusal {
    /// Sequence number of the request, plus one.
    pub sequence: u16,
    /// Session id.
    pub session: u8,
    /// Refused operation.
    pub operation: u8,
    /// Offset of the first byte.
    pub offset: u32,
    /// Reason.
    pub error: FtpError,
}

/// `MAV_FTP_ERR`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FtpError(pub u8);

#[allow(missing_docs, reason = "the names of the protocol")]
impl FtpError {
    pub const FAIL: Self = FtpError(1);
    pub const INVALID_DATA_SIZE: Self = FtpError(3);
    pub const INVALID_SESSION: Self = FtpError(4);
    pub const NO_SESSIONS_AVAILABLE: Self = FtpError(5);
    pub const EOF: Self = FtpError(6);
    pub const UNKNOWN_COMMAND: Self = FtpError(7);
    pub const FILE_EXISTS: Self = FtpError(8);
    pub const FILE_PROTECTED: Self = FtpError(9);
    pub const FILE_NOT_FOUND: Self = FtpError(10);
}

impl FileOperation {
    /// First opcode of responses.
    const ANSWERS: u8 = 128;
}

/// Opcode of a NAK, whose data is one byte with the error.
const NAK: u8 = 129;
pub(super) const ID: u32 = FILE_TRANSFER_PROTOCOL_DATA::ID;

/// Fields: network, receiver, sequence number; session, opcode, data size, requested opcode, "burst complete", padding;
/// offset; data.
const FILE: MessageLayout<FILE_TRANSFER_PROTOCOL_DATA, (u8, Address, u16, [u8; 6], u32, u8, Unused<238>)> =
    MessageLayout::NEW;

pub(super) fn format() -> MessageFormat {
    FILE.format()
}

impl FileOperation {
    /// Reads a request. Responses are refused, since they are not to be answered.
    pub(super) fn read(payload: &[u8]) -> Result<(Self, Address), FrameFault> {
        let (_, to, sequence, [session, operation, ..], offset, ..) = FILE.read(payload);
        if operation >= Self::ANSWERS {
            return Err(FrameFault::Unsupported);
        }
        Ok((FileOperation { sequence, session, operation, offset }, to))
    }

    pub(super) fn write(self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        let FileOperation { sequence, session, operation, offset } = self;
        let head = [session, operation, 0, 0, 0, 0];
        FILE.write(&(0, Address::default(), sequence, head, offset, 0, Unused), payload)
    }
}

impl FileRefusal {
    pub(super) fn read(payload: &[u8]) -> Result<(Self, Address), FrameFault> {
        let (_, to, sequence, [session, kind, _, operation, ..], offset, error, _) = FILE.read(payload);
        if kind != NAK {
            return Err(FrameFault::Unsupported);
        }
        Ok((FileRefusal { sequence, session, operation, offset, error: FtpError(error) }, to))
    }

    pub(super) fn write(self, to: Address, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        let FileRefusal { sequence, session, operation, offset, error: FtpError(error) } = self;
        let head = [session, NAK, 1, operation, 0, 0];
        FILE.write(&(0, to, sequence, head, offset, error, Unused), payload)
    }
}

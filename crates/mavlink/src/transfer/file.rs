//! Packets of MAVLink FTP: FILE_TRANSFER_PROTOCOL with its data.

use crate::address::Address;
use crate::message::PAYLOAD_MAX;
use crate::wire::MessageLayout;
use mavlink::dialects::common::FILE_TRANSFER_PROTOCOL_DATA;

/// Largest number of data bytes in a packet.
pub const FILE_DATA_MAX: usize = 239;

/// `MAV_FTP_OPCODE`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FileOpcode(pub u8);

#[allow(missing_docs, reason = "the names of the protocol")]
impl FileOpcode {
    pub const NONE: Self = FileOpcode(0);
    pub const TERMINATE_SESSION: Self = FileOpcode(1);
    pub const RESET_SESSIONS: Self = FileOpcode(2);
    pub const LIST_DIRECTORY: Self = FileOpcode(3);
    pub const OPEN_FILE_RO: Self = FileOpcode(4);
    pub const READ_FILE: Self = FileOpcode(5);
    pub const CREATE_FILE: Self = FileOpcode(6);
    pub const WRITE_FILE: Self = FileOpcode(7);
    pub const REMOVE_FILE: Self = FileOpcode(8);
    pub const CREATE_DIRECTORY: Self = FileOpcode(9);
    pub const REMOVE_DIRECTORY: Self = FileOpcode(10);
    pub const OPEN_FILE_WO: Self = FileOpcode(11);
    pub const TRUNCATE_FILE: Self = FileOpcode(12);
    pub const RENAME: Self = FileOpcode(13);
    pub const CALC_FILE_CRC32: Self = FileOpcode(14);
    pub const BURST_READ_FILE: Self = FileOpcode(15);
    pub const ACK: Self = FileOpcode(128);
    pub const NAK: Self = FileOpcode(129);
}

/// An FTP request or response.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FilePacket {
    /// Sequence number; a response has the request's number plus one.
    pub sequence: u16,
    /// Session id.
    pub session: u8,
    /// Opcode of the packet.
    pub opcode: FileOpcode,
    /// Requested opcode in a response; none in a request.
    pub answered: FileOpcode,
    /// True for the last packet of a burst.
    pub burst_complete: bool,
    /// Offset of the first byte in the file, or index of the first directory entry.
    pub offset: u32,
    /// Number of data bytes in the packet, or requested.
    pub size: u8,
    /// Data; bytes beyond `size` have no meaning.
    pub bytes: [u8; FILE_DATA_MAX],
}

/// Fields: network, receiver, sequence number; session, opcode, size, requested opcode, "burst complete", padding;
/// offset; data.
pub(super) const LAYOUT: MessageLayout<
    FILE_TRANSFER_PROTOCOL_DATA,
    (u8, Address, u16, [u8; 6], u32, [u8; FILE_DATA_MAX]),
> = MessageLayout::NEW;

impl FilePacket {
    /// Creates a request without data.
    pub const fn request(sequence: u16, opcode: FileOpcode, session: u8, offset: u32, size: u8) -> Self {
        let (answered, burst_complete, bytes) = (FileOpcode::NONE, false, [0; FILE_DATA_MAX]);
        FilePacket { sequence, session, opcode, answered, burst_complete, offset, size, bytes }
    }

    /// Returns the packet with as much of `data` as fits.
    #[must_use]
    pub fn with(mut self, data: &[u8]) -> Self {
        let fits = data.get(..FILE_DATA_MAX).unwrap_or(data);
        self.size = fits.len() as u8;
        self.bytes = [0; FILE_DATA_MAX];
        self.bytes.iter_mut().zip(fits).for_each(|(to, from)| *to = *from);
        self
    }

    /// Returns the packet's data; none if `size` is larger than possible.
    pub fn data(&self) -> Option<&[u8]> {
        self.bytes.get(..self.size.into())
    }

    /// Reads the payload of the message; returns the packet and its receiver.
    pub fn read(payload: &[u8]) -> (Self, Address) {
        let (_, to, sequence, [session, opcode, size, answered, complete, _], offset, bytes) = LAYOUT.read(payload);
        let (opcode, answered) = (FileOpcode(opcode), FileOpcode(answered));
        (FilePacket { sequence, session, opcode, answered, burst_complete: complete != 0, offset, size, bytes }, to)
    }

    pub(super) fn write(&self, to: Address, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        let FilePacket { sequence, session, opcode, answered, burst_complete, offset, size, bytes } = *self;
        let head = [session, opcode.0, size, answered.0, burst_complete.into(), 0];
        LAYOUT.write(&(0, to, sequence, head, offset, bytes), payload)
    }
}

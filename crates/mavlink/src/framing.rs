//! Layout and encoding of a MAVLink 2 frame.
//!
//! ```text
//! 0xFD  length  incompatible  compatible  sequence  system  component  id (3)
//! payload (length)  checksum (2)  [signature (13)]
//! ```
//!
//! See <https://mavlink.io/en/guide/serialization.html>. Frames with other incompatibility flags than the one for a
//! signature are not supported.

use crate::address::Address;
use crate::message::{MessageSet, PAYLOAD_MAX};
use crate::signature::{SIGNATURE, SigningKey, Stamp};

/// First byte of a frame.
pub(crate) const START: u8 = 0xFD;
/// Bytes before the payload.
pub(crate) const HEADER: usize = 10;
/// Bytes after the payload.
pub(crate) const CHECKSUM: usize = 2;
/// Incompatibility flag: a signature follows the checksum.
pub(crate) const SIGNED: u8 = 1;
/// Longest frame without a signature \[bytes\].
pub const FRAME_MAX: usize = HEADER + PAYLOAD_MAX + CHECKSUM;
/// Longest frame with a signature \[bytes\].
pub const SIGNED_FRAME_MAX: usize = FRAME_MAX + SIGNATURE;

/// A frame's header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct FrameHeader {
    pub(crate) length: u8,
    pub(crate) incompatible: u8,
    pub(crate) sequence: u8,
    pub(crate) from: Address,
    pub(crate) id: u32,
}

impl FrameHeader {
    pub(crate) fn read(bytes: &[u8; HEADER]) -> Self {
        let [_, length, incompatible, _, sequence, system, component, id0, id1, id2] = *bytes;
        let id = u32::from_le_bytes([id0, id1, id2, 0]);
        FrameHeader { length, incompatible, sequence, from: Address { system, component }, id }
    }

    /// Returns the number of bytes of the frame without a signature.
    pub(crate) fn unsigned_length(&self) -> usize {
        HEADER + usize::from(self.length) + CHECKSUM
    }

    /// Returns the number of bytes of the whole frame.
    pub(crate) fn frame_length(&self) -> usize {
        self.unsigned_length() + if self.incompatible & SIGNED != 0 { SIGNATURE } else { 0 }
    }

    fn write(&self) -> [u8; HEADER] {
        let [id0, id1, id2, _] = self.id.to_le_bytes();
        let Address { system, component } = self.from;
        [START, self.length, self.incompatible, 0, self.sequence, system, component, id0, id1, id2]
    }
}

/// Returns the CRC-16/MCRF4XX of a frame without its first byte and checksum, followed by the message's seed.
pub(crate) fn checksum(bytes: &[u8], extra_crc: u8) -> u16 {
    let accumulate = |crc: u16, byte: &u8| {
        let low = byte ^ crc as u8;
        let mixed = u16::from(low ^ (low << 4));
        (crc >> 8) ^ (mixed << 8) ^ (mixed << 3) ^ (mixed >> 4)
    };
    accumulate(bytes.iter().fold(0xFFFF, accumulate), &extra_crc)
}

/// Encoder of messages as numbered frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Encoder {
    from: Address,
    sequence: u8,
}

impl Encoder {
    /// Creates a sender with address `from`, beginning with sequence number 0.
    pub const fn new(from: Address) -> Self {
        Encoder { from, sequence: 0 }
    }

    /// Encodes `message` at the beginning of `buffer` and returns the frame.
    #[must_use = "the bytes are yet to be sent"]
    pub fn send<'a>(&mut self, message: &impl MessageSet, buffer: &'a mut [u8; FRAME_MAX]) -> &'a [u8] {
        let length = self.write(message, 0, buffer);
        buffer.get(..length).unwrap_or_default()
    }

    /// Encodes a frame like [`send`](Self::send), with a signature if `signer` gives a key and a stamp.
    #[must_use = "the bytes are yet to be sent"]
    pub fn send_signed<'a>(
        &mut self,
        message: &impl MessageSet,
        signer: Option<(&SigningKey, Stamp)>,
        buffer: &'a mut [u8; SIGNED_FRAME_MAX],
    ) -> &'a [u8] {
        let Some((frame, _)) = buffer.split_first_chunk_mut() else { return &[] };
        // The flag is set first, since checksum and signature cover it.
        let mut length = self.write(message, if signer.is_some() { SIGNED } else { 0 }, frame);
        if let Some((key, stamp)) = signer {
            let signature = key.sign(frame.get(..length).unwrap_or_default(), stamp);
            if let Some(tail) = buffer.get_mut(length..length + SIGNATURE) {
                tail.copy_from_slice(&signature);
                length += SIGNATURE;
            }
        }
        buffer.get(..length).unwrap_or_default()
    }

    /// Writes an unsigned frame with these incompatibility flags; returns its length.
    fn write(&mut self, message: &impl MessageSet, incompatible: u8, buffer: &mut [u8; FRAME_MAX]) -> usize {
        let (head, rest) = buffer.split_at_mut(HEADER);
        let Some((payload, _)) = rest.split_first_chunk_mut::<PAYLOAD_MAX>() else { return 0 };
        let (id, length) = message.write(payload);
        let header = FrameHeader { length, incompatible, sequence: self.sequence, from: self.from, id };
        self.sequence = self.sequence.wrapping_add(1);
        head.copy_from_slice(&header.write());

        let end = HEADER + usize::from(length);
        let extra_crc = crate::message::extra_crc(message, id);
        let crc = checksum(buffer.get(1..end).unwrap_or_default(), extra_crc);
        if let Some(tail) = buffer.get_mut(end..end + CHECKSUM) {
            tail.copy_from_slice(&crc.to_le_bytes());
        }
        end + CHECKSUM
    }
}

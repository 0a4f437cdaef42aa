//! What a direction of the link carries.
//!
//! MAVLink 2 appends extension fields to some messages, which the `mavlink` crate leaves out here: its feature that has
//! them does not build without std. The few that matter are read and written as bytes behind the rest.

use crate::address::Address;
use mavlink::{MavlinkVersion, MessageData};

/// Longest payload.
pub(crate) const PAYLOAD_MAX: usize = 255;

/// What is known of a message before its payload is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Format {
    /// Seed of its checksum, `CRC_EXTRA`.
    pub extra_crc: u8,
    /// Longest payload \[bytes\]. Shorter ones are completed with zeros, as MAVLink 2 wants it.
    pub length_max: usize,
}

impl Format {
    /// The format of `D`, with `extension` bytes of extension fields.
    pub(crate) const fn of<D: MessageData>(extension: usize) -> Self {
        Format { extra_crc: D::EXTRA_CRC, length_max: D::ENCODED_LEN + extension }
    }
}

/// Why a frame is dropped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Fault {
    /// The checksum is wrong: the frame was corrupted, or truncated and completed by what came after it.
    BadChecksum,
    /// The direction does not carry this message.
    Unknown,
    /// The payload is longer than the message.
    Oversized,
    /// A value is not one that its field may have.
    Malformed,
    /// A number is not finite, or beyond what is physically possible.
    Implausible,
    /// Understood, but not something that this vehicle does.
    Unsupported,
    /// Meant for somebody else.
    Elsewhere,
}

/// All messages of one direction.
pub trait Message: Sized {
    /// The format of the message numbered `id`, if this direction carries it.
    fn format(id: u32) -> Option<Format>;

    /// Reads a payload that arrived intact, in the name of `receiver`.
    ///
    /// # Errors
    /// Why it is dropped.
    fn read(id: u32, payload: &[u8], receiver: Address) -> Result<Self, Fault>;

    /// Writes the payload; returns the message's number and the payload's length.
    fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8);
}

/// The seed of a message that this direction carries.
pub(crate) fn extra_crc<M: Message>(_: &M, id: u32) -> u8 {
    M::format(id).map_or(0, |format| format.extra_crc)
}

/// Reads a payload as the message `D`.
pub(crate) fn parse<D: MessageData>(payload: &[u8]) -> Result<D, Fault> {
    D::deser(MavlinkVersion::V2, payload).map_err(|_| Fault::Malformed)
}

/// The first `N` bytes of a payload's extension fields of the message `D`, completed with zeros.
pub(crate) fn extension<D: MessageData, const N: usize>(payload: &[u8]) -> [u8; N] {
    field(payload, D::ENCODED_LEN)
}

/// The `N` bytes of a payload that begin at `offset`, completed with zeros.
pub(crate) fn field<const N: usize>(payload: &[u8], offset: usize) -> [u8; N] {
    let mut field = [0; N];
    for (byte, sent) in field.iter_mut().zip(payload.iter().skip(offset)) {
        *byte = *sent;
    }
    field
}

/// Writes the message `data`.
pub(crate) fn put<D: MessageData>(data: &D, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
    (D::ID, data.ser(MavlinkVersion::V2, payload) as u8)
}

/// Writes the fields of the message numbered `id`, as they follow each other, without the zeros at their end.
pub(crate) fn put_fields(id: u32, fields: impl IntoIterator<Item = u8>, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
    // Never shorter than a byte.
    let mut length = 1;
    for (place, (byte, sent)) in payload.iter_mut().zip(fields).enumerate() {
        *byte = sent;
        if sent != 0 {
            length = (place + 1) as u8;
        }
    }
    (id, length)
}

/// Writes the message `data` and its extension fields, without the zeros at their end.
pub(crate) fn put_extended<D: MessageData>(
    data: &D,
    extension: impl IntoIterator<Item = u8>,
    payload: &mut [u8; PAYLOAD_MAX],
) -> (u32, u8) {
    let (id, mut length) = put(data, payload);
    for (place, (byte, sent)) in payload.iter_mut().skip(D::ENCODED_LEN).zip(extension).enumerate() {
        *byte = sent;
        if sent != 0 {
            length = (D::ENCODED_LEN + place + 1) as u8;
        }
    }
    (id, length)
}

//! Messages of one direction of the link.
//!
//! MAVLink 2 appends extension fields to some messages. The `mavlink` crate omits them here, since its feature for them
//! requires std. The few that are needed are read and written as bytes.

use crate::address::Address;
use mavlink::{MavlinkVersion, MessageData};

/// Longest payload.
pub(crate) const PAYLOAD_MAX: usize = 255;

/// Properties of a message needed before its payload is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MessageFormat {
    /// Seed of the checksum, `CRC_EXTRA`.
    pub extra_crc: u8,
    /// Longest payload that is read \[bytes\]. Shorter ones are padded with zeros, as MAVLink 2 requires, and the rest
    /// of longer ones is left out.
    pub length_max: usize,
}

impl MessageFormat {
    /// The format of `D`, with `extension` bytes of extension fields.
    pub(crate) const fn of<D: MessageData>(extension: usize) -> Self {
        MessageFormat { extra_crc: D::EXTRA_CRC, length_max: D::ENCODED_LEN + extension }
    }
}

/// Why a frame is dropped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Fault {
    /// Wrong checksum: the frame was corrupted, or truncated and completed by the bytes that followed.
    BadChecksum,
    /// The direction does not carry this message.
    Unknown,
    /// A field has an invalid value.
    Malformed,
    /// A number is not finite or not physically plausible.
    Implausible,
    /// Understood, but not supported by this vehicle.
    Unsupported,
    /// Addressed to another system.
    Elsewhere,
}

/// All messages of one direction.
pub trait Message: Sized {
    /// Returns the format of the message numbered `id`, if this direction carries it.
    fn format(id: u32) -> Option<MessageFormat>;

    /// Reads a payload that arrived intact, for the address `receiver`.
    ///
    /// # Errors
    /// The reason for which it is dropped.
    fn read(id: u32, payload: &[u8], receiver: Address) -> Result<Self, Fault>;

    /// Writes the payload; returns the message's number and the payload's length.
    fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8);
}

/// Returns the checksum's seed of a message that this direction carries.
pub(crate) fn extra_crc<M: Message>(_: &M, id: u32) -> u8 {
    M::format(id).map_or(0, |format| format.extra_crc)
}

/// Reads a payload as the message `D`.
pub(crate) fn parse<D: MessageData>(payload: &[u8]) -> Result<D, Fault> {
    D::deser(MavlinkVersion::V2, payload).map_err(|_| Fault::Malformed)
}

/// Returns the first `N` bytes of the extension fields of the message `D`, padded with zeros.
pub(crate) fn extension<D: MessageData, const N: usize>(payload: &[u8]) -> [u8; N] {
    field(payload, D::ENCODED_LEN)
}

/// Returns the `N` bytes of a payload from `offset` on, padded with zeros.
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

/// Writes the message `data` and its extension fields, without trailing zeros.
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

//! Interface of the messages of one direction.
//!
//! MAVLink 2 appends extension fields to some messages. The `mavlink` crate omits them here, since its feature for them
//! requires std. The few that are needed are read and written as bytes.

use crate::address::Address;
use mavlink::{MavlinkVersion, MessageData};

/// Longest payload \[bytes\].
pub(crate) const PAYLOAD_MAX: usize = 255;

/// Properties of a message that are needed before its payload is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MessageFormat {
    /// Seed of the checksum, `CRC_EXTRA`.
    pub extra_crc: u8,
    /// Number of payload bytes that are read. Shorter payloads are padded with zeros, as MAVLink 2 requires; the rest
    /// of longer ones is ignored.
    pub length_max: usize,
}

impl MessageFormat {
    /// Returns the format of `D` with `extension` bytes of extension fields.
    pub(crate) const fn of<D: MessageData>(extension: usize) -> Self {
        MessageFormat { extra_crc: D::EXTRA_CRC, length_max: D::ENCODED_LEN + extension }
    }
}

/// Reason for dropping a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum FrameFault {
    /// Wrong checksum: the frame was corrupted, or was truncated and completed by later bytes.
    BadChecksum,
    /// The direction does not carry this message.
    Unknown,
    /// A field has an invalid value.
    Malformed,
    /// A number is not finite or not physically plausible.
    Implausible,
    /// The message is valid, but this vehicle does not support it.
    Unsupported,
    /// The message is for another system.
    Elsewhere,
}

/// All messages of one direction.
pub trait MessageSet: Sized {
    /// Returns the format of the message numbered `id`, if this direction carries it.
    fn format(id: u32) -> Option<MessageFormat>;

    /// Reads an intact payload for the receiver with address `receiver`.
    ///
    /// # Errors
    /// The reason for dropping the message.
    fn read(id: u32, payload: &[u8], receiver: Address) -> Result<Self, FrameFault>;

    /// Writes the payload; returns the message id and the payload's length.
    fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8);
}

/// Returns the checksum's seed of a message that this direction carries.
pub(crate) fn extra_crc<M: MessageSet>(_: &M, id: u32) -> u8 {
    M::format(id).map_or(0, |format| format.extra_crc)
}

/// Reads a payload as the message `D`.
pub(crate) fn parse<D: MessageData>(payload: &[u8]) -> Result<D, FrameFault> {
    D::deser(MavlinkVersion::V2, payload).map_err(|_| FrameFault::Malformed)
}

/// Returns the first `N` bytes of the extension fields of the message `D`, padded with zeros.
pub(crate) fn extension<D: MessageData, const N: usize>(payload: &[u8]) -> [u8; N] {
    field(payload, D::ENCODED_LEN)
}

/// Returns the `N` bytes of a payload at `offset`, padded with zeros.
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

/// Writes the message `data` with its extension fields, without trailing zeros.
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

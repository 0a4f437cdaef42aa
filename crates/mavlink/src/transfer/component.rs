//! Location of a component's metadata: COMPONENT_METADATA, and the older COMPONENT_INFORMATION.

use crate::message::PAYLOAD_MAX;
use crate::wire::{MessageLayout, Unused};
use mavlink::dialects::common::{COMPONENT_INFORMATION_DATA, COMPONENT_METADATA_DATA};

/// Longest URI \[bytes\].
const URI_MAX: usize = 100;

/// Location of the general metadata file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ComponentMetadata {
    /// Time since power-up \[ms\].
    pub time_ms: u32,
    /// CRC-32 of the file, as in MAVLink FTP.
    pub crc: u32,
    /// URI of the file, padded with zeros.
    pub uri: [u8; URI_MAX],
}

pub(super) const METADATA: MessageLayout<COMPONENT_METADATA_DATA, ([u32; 2], [u8; URI_MAX])> = MessageLayout::NEW;
/// Fields: time, checksum, checksum of the peripherals' file; URI, URI of the peripherals' file.
pub(super) const INFORMATION: MessageLayout<COMPONENT_INFORMATION_DATA, ([u32; 3], [u8; URI_MAX], Unused<URI_MAX>)> =
    MessageLayout::NEW;

impl ComponentMetadata {
    /// Creates the message for a metadata file with a URI of up to 100 bytes.
    pub fn at(uri: &str, crc: u32) -> Self {
        let mut metadata = ComponentMetadata { time_ms: 0, crc, uri: [0; URI_MAX] };
        metadata.uri.iter_mut().zip(uri.bytes()).for_each(|(to, byte)| *to = byte);
        metadata
    }

    pub(super) fn read(payload: &[u8]) -> Self {
        let ([time_ms, crc], uri) = METADATA.read(payload);
        ComponentMetadata { time_ms, crc, uri }
    }

    pub(super) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        METADATA.write(&([self.time_ms, self.crc], self.uri), payload)
    }

    pub(super) fn read_information(payload: &[u8]) -> Self {
        let ([time_ms, crc, _], uri, _) = INFORMATION.read(payload);
        ComponentMetadata { time_ms, crc, uri }
    }

    pub(super) fn write_information(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        INFORMATION.write(&([self.time_ms, self.crc, 0], self.uri, Unused), payload)
    }
}

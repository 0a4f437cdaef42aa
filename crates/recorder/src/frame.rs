//! Frames: records on a wire or in a file, with a checksum.

use crate::record::Record;
use crc::{CRC_32_ISO_HDLC, Crc};
use postcard::ser_flavors::crc::CrcModifier;
use postcard::ser_flavors::{Cobs, Slice};

const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// Length of the longest frame \[bytes\].
pub const FRAME_MAX: usize = 1024;

/// Writes a record's frame into `buffer`; none if it does not fit, which [`FRAME_MAX`] bytes always do.
pub fn write<'b>(record: &Record, buffer: &'b mut [u8]) -> Option<&'b mut [u8]> {
    let cobs = Cobs::try_new(Slice::new(buffer)).ok()?;
    postcard::serialize_with_flavor(record, CrcModifier::new(cobs, CRC.digest())).ok()
}

/// Takes frames from bytes as they come, and counts those that are damaged.
#[derive(Clone, Debug)]
pub struct Frames {
    bytes: [u8; FRAME_MAX],
    length: usize,
    damaged: u32,
}

impl Default for Frames {
    fn default() -> Self {
        Frames { bytes: [0; FRAME_MAX], length: 0, damaged: 0 }
    }
}

impl Frames {
    /// Returns the number of frames that were none: damaged, cut off, or longer than any.
    pub fn damaged(&self) -> u32 {
        self.damaged
    }

    /// Takes a byte, and returns the record whose frame ends with it.
    pub fn take(&mut self, byte: u8) -> Option<Record> {
        if byte != 0 {
            // One that is too long is counted at its end.
            if let Some(place) = self.bytes.get_mut(self.length) {
                *place = byte;
            }
            self.length = self.length.saturating_add(1);
            return None;
        }
        let length = core::mem::take(&mut self.length);
        if length == 0 {
            return None;
        }
        let record = self.bytes.get_mut(..length).and_then(|frame| {
            let length = cobs::decode_in_place(frame).ok()?;
            postcard::from_bytes_crc32(frame.get(..length)?, CRC.digest()).ok()
        });
        self.damaged = self.damaged.saturating_add(u32::from(record.is_none()));
        record
    }
}

//! Frames: records on a wire or in a file, with a checksum.

use crate::exact::record::{Record, VERSION};
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

/// Why bytes are no record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameError {
    /// They are damaged, cut off, or something else.
    Damaged,
    /// They are whole, but of another version of the format: this one, if they say so.
    Foreign(Option<u16>),
}

/// Reads a frame, without the zero at its end; its bytes are overwritten.
///
/// # Errors
/// Why it is no record.
pub fn decode(frame: &mut [u8]) -> Result<Record, FrameError> {
    let length = cobs::decode_in_place(frame).map_err(|_| FrameError::Damaged)?;
    let (body, sum) = frame.get(..length).and_then(<[u8]>::split_last_chunk::<4>).ok_or(FrameError::Damaged)?;
    if CRC.checksum(body) != u32::from_le_bytes(*sum) {
        return Err(FrameError::Damaged);
    }
    let foreign = || FrameError::Foreign(version(body).filter(|version| *version != VERSION));
    match postcard::take_from_bytes(body) {
        Ok((Record::Start(start), _)) if start.version != VERSION => Err(foreign()),
        // Bytes that are left show another version, whose beginning happens to read as a record of this one.
        Ok((record, [])) => Ok(record),
        _ => Err(foreign()),
    }
}

/// Returns the version that a start of any version says.
fn version(body: &[u8]) -> Option<u16> {
    // The first kind of record, and its first field.
    let (kind, rest): (u8, _) = postcard::take_from_bytes(body).ok()?;
    if kind == 0 { postcard::take_from_bytes(rest).ok().map(|(version, _)| version) } else { None }
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
        let record = self.bytes.get_mut(..length).and_then(|frame| decode(frame).ok());
        self.damaged = self.damaged.saturating_add(u32::from(record.is_none()));
        record
    }
}

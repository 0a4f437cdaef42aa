//! Reads and writes frames: records of the exact log with a checksum, as they go over a link or into a file.

use crate::exact::record::{Record, VERSION};
use crc::{CRC_32_ISO_HDLC, Crc};
use postcard::ser_flavors::crc::CrcModifier;
use postcard::ser_flavors::{Cobs, Slice};

const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// Length of the longest frame \[bytes\].
pub const FRAME_MAX: usize = 1024;

/// Writes a record's frame into `buffer`. Returns none if the frame does not fit; every frame fits into [`FRAME_MAX`]
/// bytes.
pub fn write<'b>(record: &Record, buffer: &'b mut [u8]) -> Option<&'b mut [u8]> {
    let cobs = Cobs::try_new(Slice::new(buffer)).ok()?;
    postcard::serialize_with_flavor(record, CrcModifier::new(cobs, CRC.digest())).ok()
}

/// Reasons why bytes cannot be read as a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameError {
    /// The bytes are damaged, cut off, or no frame at all.
    Damaged,
    /// The frame is intact, but written by another version of the format. Holds that version, if the frame states it.
    Foreign(Option<u16>),
}

/// Reads a frame without its terminating zero. Overwrites the frame's bytes.
///
/// # Errors
/// A [`FrameError`] if the frame holds no record of this version.
pub fn decode(frame: &mut [u8]) -> Result<Record, FrameError> {
    let length = cobs::decode_in_place(frame).map_err(|_| FrameError::Damaged)?;
    let (body, sum) = frame.get(..length).and_then(<[u8]>::split_last_chunk::<4>).ok_or(FrameError::Damaged)?;
    if CRC.checksum(body) != u32::from_le_bytes(*sum) {
        return Err(FrameError::Damaged);
    }
    let foreign = || FrameError::Foreign(version(body).filter(|version| *version != VERSION));
    match postcard::take_from_bytes(body) {
        Ok((Record::Start(start), _)) if start.version != VERSION => Err(foreign()),
        // Leftover bytes mean that another version wrote them. Its first bytes happen to read as a record of this
        // version.
        Ok((record, [])) => Ok(record),
        _ => Err(foreign()),
    }
}

/// Returns the version that a start record of any version states.
fn version(body: &[u8]) -> Option<u16> {
    // A start record is kind 0, and the version is its first field.
    let (kind, rest): (u8, _) = postcard::take_from_bytes(body).ok()?;
    if kind == 0 { postcard::take_from_bytes(rest).ok().map(|(version, _)| version) } else { None }
}

/// Splits a stream of bytes into frames, reads their records, and counts damaged frames.
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
    /// Returns the number of frames that could not be read: damaged, cut off, too long, or of another version.
    pub fn damaged(&self) -> u32 {
        self.damaged
    }

    /// Takes one byte. Returns the record if the byte completes a readable frame.
    pub fn take(&mut self, byte: u8) -> Option<Record> {
        if byte != 0 {
            // Bytes beyond the buffer are dropped; the frame counts as damaged when it ends.
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

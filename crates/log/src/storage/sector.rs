//! Reads and writes the head of a sector of flash that contains a log.
//!
//! The sector's first page is its head, in little-endian words: the mark (8 bytes), the log's number, the part's
//! number, and both numbers inverted. In a finished log's last part, its length in this sector follows, and the same
//! inverted. The inverses reveal words that a power cut left half programmed: programming only turns ones into zeros,
//! and one bit of each pair must stay one.

use crate::storage::flash::{PROGRAM_BYTES, SECTOR_BYTES};

/// Offset of the log's data in a sector, and the most bytes of data in one sector.
pub(crate) const START: u32 = PROGRAM_BYTES;
pub(crate) const ROOM: u32 = SECTOR_BYTES - START;
/// Length of the mark and the part's words, and the offset of the length's words.
pub(crate) const HEAD_BYTES: usize = 24;
pub(crate) const LENGTH_AT: u32 = HEAD_BYTES as u32;
const MARK: &[u8; 8] = b"AFBCLOG1";

/// Head of a sector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Head {
    /// Number of the log, from 1 on, and number of the part, from 0 on.
    pub(crate) log: u32,
    pub(crate) part: u32,
}

impl Head {
    pub(crate) fn bytes(self) -> [u8; HEAD_BYTES] {
        let mut bytes = [0; HEAD_BYTES];
        let words = [self.log, self.part, !self.log, !self.part].into_iter().flat_map(u32::to_le_bytes);
        bytes.iter_mut().zip(MARK.iter().copied().chain(words)).for_each(|(place, byte)| *place = byte);
        bytes
    }

    /// Returns the head that these bytes encode, or none if they are not intact.
    pub(crate) fn read(bytes: &[u8; HEAD_BYTES]) -> Option<Self> {
        let (log, part) = (word(bytes, 8), word(bytes, 12));
        let head = Head { log, part };
        (head.bytes() == *bytes).then_some(head)
    }
}

/// Returns the encoded length of the log in its last sector.
pub(crate) fn length_bytes(length: u32) -> [u8; 8] {
    let mut bytes = [0; 8];
    let words = [length, !length].into_iter().flat_map(u32::to_le_bytes);
    bytes.iter_mut().zip(words).for_each(|(place, byte)| *place = byte);
    bytes
}

/// Returns the length that these bytes encode, or none if they are not intact.
pub(crate) fn read_length(bytes: &[u8; 8]) -> Option<u32> {
    let length = word(bytes, 0);
    (length <= ROOM && length_bytes(length) == *bytes).then_some(length)
}

fn word(bytes: &[u8], at: usize) -> u32 {
    bytes.get(at..).and_then(<[u8]>::first_chunk).map_or(0, |bytes| u32::from_le_bytes(*bytes))
}

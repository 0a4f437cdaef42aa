//! A sector of a log: a page with what it is, then the log.
//!
//! Of that page, in little-endian words: the mark (8 bytes), the log's number, the part of it that this is, both
//! inverted, and in the last part of a log that has ended the bytes of the log in it, the same inverted. What a cut of
//! the power leaves of a word is not the inverse of what it leaves of the other, unless both are whole: programming
//! makes ones zeros, and of each pair of bits one stays.

use crate::storage::flash::{PROGRAM_BYTES, SECTOR_BYTES};

/// Where the log begins in a sector, and its bytes in it, at most.
pub(crate) const START: u32 = PROGRAM_BYTES;
pub(crate) const ROOM: u32 = SECTOR_BYTES - START;
/// The mark, the part's words, and the length's.
pub(crate) const HEAD_BYTES: usize = 24;
pub(crate) const LENGTH_AT: u32 = HEAD_BYTES as u32;
const MARK: &[u8; 8] = b"AFBCLOG1";

/// What a sector is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Head {
    /// The log, numbered from 1 on, and the part of it, from 0 on.
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

    /// Returns what these bytes say, if they are whole.
    pub(crate) fn read(bytes: &[u8; HEAD_BYTES]) -> Option<Self> {
        let (log, part) = (word(bytes, 8), word(bytes, 12));
        let head = Head { log, part };
        (head.bytes() == *bytes).then_some(head)
    }
}

/// Returns the bytes that say how much of the log is in its last sector.
pub(crate) fn length_bytes(length: u32) -> [u8; 8] {
    let mut bytes = [0; 8];
    let words = [length, !length].into_iter().flat_map(u32::to_le_bytes);
    bytes.iter_mut().zip(words).for_each(|(place, byte)| *place = byte);
    bytes
}

/// Returns what they say, if they are whole.
pub(crate) fn read_length(bytes: &[u8; 8]) -> Option<u32> {
    let length = word(bytes, 0);
    (length <= ROOM && length_bytes(length) == *bytes).then_some(length)
}

fn word(bytes: &[u8], at: usize) -> u32 {
    bytes.get(at..).and_then(<[u8]>::first_chunk).map_or(0, |bytes| u32::from_le_bytes(*bytes))
}

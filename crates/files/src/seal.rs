//! A checksum inside the file that it protects, so that copies are protected too.
//!
//! Near its end the file holds `xxh64:` and 16 digits: the file's own XXH64, computed with zeros in place of the
//! digits.

use core::hash::Hasher;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;
use twox_hash::XxHash64;

/// Tag in a file before it is sealed.
pub const OPEN: &str = "xxh64:0000000000000000";
const TAG: &[u8] = b"xxh64:";
const ZEROS: &[u8; 16] = b"0000000000000000";
/// Number of bytes at the end of a file that must contain the tag.
const TAIL: usize = 4096;

/// Returns the offset of the last tag's digits.
fn digits(tail: &[u8]) -> Option<usize> {
    let tag = tail.windows(OPEN.len()).rposition(|window| window.starts_with(TAG))?;
    Some(tag + TAG.len())
}

/// Writer that seals its data, which must contain [`OPEN`] near the end.
pub struct SealingWriter<W> {
    out: W,
    hash: XxHash64,
    /// Last bytes so far, held back since they may contain the tag.
    held: Vec<u8>,
}

impl<W: Write> SealingWriter<W> {
    /// Creates a writer that seals the data and writes them to `out`.
    pub fn new(out: W) -> Self {
        SealingWriter { out, hash: XxHash64::with_seed(0), held: Vec::new() }
    }

    /// Fills in the checksum and writes the rest.
    pub fn finish(mut self) -> io::Result<()> {
        self.hash.write(&self.held);
        let sum = format!("{:016x}", self.hash.finish());
        let place = digits(&self.held).and_then(|at| self.held.get_mut(at..at + sum.len()));
        place.ok_or_else(|| io::Error::other("the file has no place for a checksum"))?.copy_from_slice(sum.as_bytes());
        self.out.write_all(&self.held)
    }
}

impl<W: Write> Write for SealingWriter<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.held.extend_from_slice(bytes);
        // Writes in large pieces, since each time the held bytes are moved.
        if self.held.len() > 16 * TAIL {
            let rest = self.held.split_off(self.held.len() - TAIL);
            self.hash.write(&self.held);
            self.out.write_all(&self.held)?;
            self.held = rest;
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

/// Writes `value`, whose last field contains [`OPEN`], and seals it.
pub fn json(out: &mut dyn Write, value: &impl serde::Serialize) -> io::Result<()> {
    let mut out = SealingWriter::new(out);
    serde_json::to_writer_pretty(&mut out, value)?;
    writeln!(out)?;
    out.finish()
}

/// Returns the XXH64 of a file, in the format of a seal.
///
/// # Errors
/// If it cannot be read.
pub fn hash_of_file(path: &Path) -> io::Result<String> {
    let mut out = HashingWriter::new(io::sink());
    io::copy(&mut File::open(path)?, &mut out)?;
    Ok(out.finish())
}

/// Returns a hash of everything that decides a result, computed over its JSON. Numbers are exact. Infinity, for an
/// event without end, is written as null, like no other number.
pub fn hash_of(decides: &impl serde::Serialize) -> String {
    let mut out = HashingWriter::new(io::sink());
    let written = serde_json::to_writer(&mut out, decides);
    debug_assert!(written.is_ok(), "the data cannot be written as JSON");
    format!("{:016x}", out.hash.finish())
}

/// Writer that passes its data on and hashes them.
pub(crate) struct HashingWriter<W> {
    out: W,
    hash: XxHash64,
}

impl<W> HashingWriter<W> {
    pub(crate) fn new(out: W) -> Self {
        HashingWriter { out, hash: XxHash64::with_seed(0) }
    }

    /// Returns the hash in the format of [`hash_of_file`].
    pub(crate) fn finish(self) -> String {
        format!("xxh64:{:016x}", self.hash.finish())
    }
}

impl<W: Write> Write for HashingWriter<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.out.write(bytes)?;
        self.hash.write(bytes.get(..written).unwrap_or_default());
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

/// Checks that a sealed file is unchanged.
///
/// # Errors
/// If it is changed, or cannot be read.
pub fn verify(file: &mut (impl Read + Seek)) -> io::Result<()> {
    let broken = |problem: &str| io::Error::new(io::ErrorKind::InvalidData, problem);
    let start = file.seek(SeekFrom::End(0))?.saturating_sub(TAIL as u64);
    let mut tail = Vec::new();
    file.seek(SeekFrom::Start(start))?;
    file.read_to_end(&mut tail)?;
    let at = digits(&tail).ok_or_else(|| broken("the file has no checksum"))?;
    let mut hash = XxHash64::with_seed(0);
    file.seek(SeekFrom::Start(0))?;
    let (mut left, mut buffer) = (start, vec![0; 1 << 16]);
    while left > 0 {
        let want = buffer.len().min(usize::try_from(left).unwrap_or(usize::MAX));
        let piece = buffer.get_mut(..want).ok_or_else(|| broken("too long"))?;
        file.read_exact(piece)?;
        hash.write(piece);
        left -= want as u64;
    }
    let (before, rest) = tail.split_at_checked(at).ok_or_else(|| broken("the file has no checksum"))?;
    let (sum, after) = rest.split_at_checked(ZEROS.len()).ok_or_else(|| broken("the file has no checksum"))?;
    for piece in [before, ZEROS, after] {
        hash.write(piece);
    }
    file.seek(SeekFrom::Start(0))?;
    if format!("{:016x}", hash.finish()).as_bytes() == sum {
        Ok(())
    } else {
        Err(broken("the file's checksum is wrong"))
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]
    use super::*;
    use std::io::Cursor;

    fn sealed(before: usize, after: usize, piece: usize) -> Vec<u8> {
        let mut bytes: Vec<u8> = (0..before).map(|i| (i * 7 % 251) as u8).collect();
        bytes.extend_from_slice(OPEN.as_bytes());
        bytes.extend(std::iter::repeat_n(b'.', after));
        let mut out = Vec::new();
        let mut sealing = SealingWriter::new(&mut out);
        bytes.chunks(piece).for_each(|piece| sealing.write_all(piece).unwrap());
        sealing.finish().unwrap();
        out
    }

    /// Checks lengths around the size of the held bytes, and two ways to cut the data into pieces.
    #[test]
    fn no_flipped_bit_passes() {
        for (before, after) in [(0, 0), (1, 9), (TAIL - 30, 8), (16 * TAIL, 100), (40 * TAIL + 1, TAIL - 50)] {
            let bytes = sealed(before, after, 1000);
            assert_eq!(bytes, sealed(before, after, 77_777));
            verify(&mut Cursor::new(&bytes)).unwrap();
            // The test flips every bit of the last 300 bytes, and of some of the others.
            let positions = (0..bytes.len()).filter(|at| at + 300 > bytes.len() || at % 1009 == 0);
            for (at, bit) in positions.flat_map(|at| (0..8).map(move |bit| (at, bit))) {
                let mut flipped = bytes.clone();
                flipped[at] ^= 1 << bit;
                assert!(verify(&mut Cursor::new(flipped)).is_err(), "bit {bit} of byte {at} of {}", bytes.len());
            }
            for length in (0..bytes.len()).filter(|length| length + 300 > bytes.len() || length % 1009 == 0) {
                assert!(verify(&mut Cursor::new(&bytes[..length])).is_err(), "cut to {length}");
            }
        }
    }
}

//! Records: the unit of writing to the flash.

use core::fmt;
use crc::{CRC_32_ISO_HDLC, Crc};

/// Largest length of a name, as in MAVLink.
pub const NAME_MAX: usize = 16;
/// Size of a record \[bytes\], a multiple of a flash word.
pub(crate) const RECORD: usize = 28;

static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// Returns the number that identifies the owner of a store's values, from a name such as the vehicle's.
pub fn hash(name: &[u8]) -> u32 {
    CRC.checksum(name)
}

/// Name of a value: 1 to 16 printable ASCII characters.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RecordName([u8; NAME_MAX]);

impl RecordName {
    /// Name of records that hold no single value.
    pub(crate) const NONE: RecordName = RecordName([0; NAME_MAX]);

    /// Creates a name, `None` if `name` is empty, longer than 16 characters or not printable ASCII.
    pub fn new(name: &str) -> Option<Self> {
        RecordName::of(name.chars())
    }

    /// Creates a name from characters, like [`RecordName::new`].
    pub fn of(name: impl Iterator<Item = char>) -> Option<Self> {
        let (mut bytes, mut length) = ([0; NAME_MAX], 0);
        for c in name {
            *bytes.get_mut(length)? = u8::try_from(c).ok().filter(u8::is_ascii_graphic)?;
            length += 1;
        }
        (length > 0).then_some(RecordName(bytes))
    }

    /// Returns true if the name begins with an underscore. Such a value belongs to the board and survives a
    /// [reset](crate::Store::reset) and a change of the owner.
    pub const fn outlasts(&self) -> bool {
        matches!(self.0, [b'_', ..])
    }

    /// Returns the name, padded with zeros.
    pub const fn to_bytes(self) -> [u8; NAME_MAX] {
        self.0
    }

    /// Returns the name as text.
    pub fn as_str(&self) -> &str {
        let end = self.0.iter().position(|byte| *byte == 0).unwrap_or(NAME_MAX);
        self.0.get(..end).and_then(|bytes| str::from_utf8(bytes).ok()).unwrap_or_default()
    }
}

impl fmt::Display for RecordName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

impl fmt::Debug for RecordName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self.as_str(), f)
    }
}

/// Content of a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RecordContent {
    /// First record of a sector, written last. The sector with the largest `sequence` is active.
    Header { sequence: u32 },
    /// Makes all earlier values void; later values belong to `owner`.
    Begin { owner: u32 },
    /// Value of `name` in its owner's `edition`. `None` deletes the value.
    Value { name: RecordName, edition: u16, bits: Option<u32> },
}

/// Codes of the record kinds. A torn write tends to 0 or 0xFFFF, so neither is used.
const HEADER: u16 = 0x4831;
const BEGIN: u16 = 0x4232;
const VALUE: u16 = 0x5633;
const NOTHING: u16 = 0x4E34;

impl RecordContent {
    /// Returns the record's bytes: name, value, edition, kind, checksum; little-endian.
    pub(crate) fn to_bytes(self) -> [u8; RECORD] {
        let (name, bits, edition, kind) = match self {
            RecordContent::Header { sequence } => (RecordName::NONE, sequence, 0, HEADER),
            RecordContent::Begin { owner } => (RecordName::NONE, owner, 0, BEGIN),
            RecordContent::Value { name, edition, bits: Some(bits) } => (name, bits, edition, VALUE),
            RecordContent::Value { name, edition, bits: None } => (name, 0, edition, NOTHING),
        };
        let fields = [bits.to_le_bytes(), (u32::from(edition) | u32::from(kind) << 16).to_le_bytes()];
        let mut bytes = [0; RECORD];
        let all = name.0.into_iter().chain(fields.into_iter().flatten());
        bytes.iter_mut().zip(all).for_each(|(to, from)| *to = from);
        if let Some((body, sum)) = bytes.split_last_chunk_mut::<4>() {
            *sum = CRC.checksum(body).to_le_bytes();
        }
        bytes
    }

    /// Reads a record, `None` if the bytes are blank, torn or no record.
    pub(crate) fn from_bytes(bytes: &[u8; RECORD]) -> Option<Self> {
        let (body, sum) = bytes.split_last_chunk::<4>()?;
        if CRC.checksum(body) != u32::from_le_bytes(*sum) {
            return None;
        }
        let (name, fields) = body.split_first_chunk::<NAME_MAX>()?;
        let (bits, rest) = fields.split_first_chunk::<4>()?;
        let (edition, kind) = rest.split_first_chunk::<2>()?;
        let kind = u16::from_le_bytes(*kind.first_chunk()?);
        let (name, bits, edition) = (RecordName(*name), u32::from_le_bytes(*bits), u16::from_le_bytes(*edition));
        let is_name = RecordName::new(name.as_str()) == Some(name);
        match kind {
            HEADER => Some(RecordContent::Header { sequence: bits }),
            BEGIN => Some(RecordContent::Begin { owner: bits }),
            VALUE if is_name => Some(RecordContent::Value { name, edition, bits: Some(bits) }),
            NOTHING if is_name => Some(RecordContent::Value { name, edition, bits: None }),
            _ => None,
        }
    }
}

//! Replies of motor controllers on bidirectional DSHOT: what comes back over the motor's own wire after a frame.
//!
//! The idle line is high, and frames are inverted, with a complemented checksum
//! ([`DshotFrame::bidirectional`](crate::dshot::DshotFrame::bidirectional)). Some 30 us after one, a motor controller
//! answers with 21 bits at 5/4 of the frame's rate: a low start bit, then sixteen bits in groups of four, each group as
//! five bits of a group code (GCR) of which a one is a change of level. The sixteen bits are twelve of content and a
//! complemented checksum. The content is the period of an electrical revolution, or, between periods, another quantity
//! (extended telemetry, EDT).
//!
//! No board asks for such replies yet.

/// Bits of a reply on the wire, the start bit included.
pub const REPLY_BITS: u32 = 21;
/// Changes of level in a reply, at most, the start bit's included.
pub const EDGES_MAX: usize = REPLY_BITS as usize + 1;

/// A period that no rotor has: it stands.
const STOPPED: u16 = 0xFFF;

/// What a motor controller has replied.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DshotReply {
    /// Period of an electrical revolution \[us\]; none of a motor that stands.
    Period(Option<u32>),
    /// Temperature \[deg C\].
    Temperature(u8),
    /// Voltage of the supply \[0.25 V\].
    Voltage(u8),
    /// Current \[A\].
    Current(u8),
    /// Anything else of extended telemetry, with its type: 4 to 6 debugging, 7 state and events; 0 for a period of
    /// zero, which no motor has.
    Other(u8, u8),
}

/// Why bits are no reply.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReplyError {
    /// The line has changed too seldom, too often, or at times that are none of a bit's.
    Timing,
    /// Five bits are none of the code's groups.
    Group,
    /// The checksum is wrong.
    Checksum,
}

impl DshotReply {
    /// Reads twelve bits of content.
    const fn of(content: u16) -> Self {
        let (exponent, mantissa) = ((content >> 9) as u32, (content & 0x1FF) as u32);
        let low = (content & 0xFF) as u8;
        match (content >> 8) as u8 {
            _ if content == STOPPED => DshotReply::Period(None),
            _ if content == 0 => DshotReply::Other(0, 0),
            0x2 => DshotReply::Temperature(low),
            0x4 => DshotReply::Voltage(low),
            0x6 => DshotReply::Current(low),
            kind @ (0x8 | 0xA | 0xC | 0xE) => DshotReply::Other(kind / 2, low),
            // Periods are written with the highest bit of the mantissa set, or no exponent.
            _ => DshotReply::Period(Some(mantissa << exponent)),
        }
    }

    /// Reads a reply from its sixteen bits.
    ///
    /// # Errors
    /// A wrong checksum.
    pub const fn from_bits(bits: u16) -> Result<Self, ReplyError> {
        match (bits ^ (bits >> 4) ^ (bits >> 8) ^ (bits >> 12)) & 0xF {
            0xF => Ok(Self::of(bits >> 4)),
            _ => Err(ReplyError::Checksum),
        }
    }

    /// Reads a reply from the twenty bits of its code, the first one highest.
    ///
    /// # Errors
    /// The first thing that is wrong.
    pub fn from_code(code: u32) -> Result<Self, ReplyError> {
        let mut bits = 0_u16;
        for group in [15, 10, 5, 0].map(|at| code >> at & 0x1F) {
            let Some(nibble) = (0_u16..).zip(GROUPS).find(|(_, known)| *known == group) else {
                return Err(ReplyError::Group);
            };
            bits = bits << 4 | nibble.0;
        }
        Self::from_bits(bits)
    }

    /// Reads a reply from the times of the line's changes, in counts of a timer whose count wraps with the type's; the
    /// first is that of the start bit. `bit_counts` are the counts of a reply's bit: four fifths of a frame's. Each
    /// bit's length may be off by a third or so; what comes after the reply's last bit is left out.
    ///
    /// # Errors
    /// The first thing that is wrong.
    pub fn from_edges(edges: &[u16], bit_counts: u16) -> Result<Self, ReplyError> {
        let mut times = edges.iter();
        let (Some(mut last), 1..) = (times.next(), bit_counts) else { return Err(ReplyError::Timing) };
        let (mut code, mut at) = (0_u32, 0_u32);
        for time in times {
            let counts = u32::from(time.wrapping_sub(*last));
            // Not divided by zero: a length of 0 has been refused above.
            let bits = (counts + u32::from(bit_counts) / 2) / u32::from(bit_counts);
            if bits == 0 {
                return Err(ReplyError::Timing);
            }
            at = at.saturating_add(bits);
            if at >= REPLY_BITS {
                break;
            }
            // A shift by 0 to 19: the start bit, at 0, is no part of the code.
            code |= 1 << (REPLY_BITS - 1 - at);
            last = time;
        }
        Self::from_code(code)
    }

    /// Reads a reply from levels of the line at equal times, `per_bit` of them in each bit of it.
    ///
    /// # Errors
    /// The first thing that is wrong.
    pub fn from_samples(levels: impl IntoIterator<Item = bool>, per_bit: u16) -> Result<Self, ReplyError> {
        let mut edges = [0_u16; EDGES_MAX];
        let (mut count, mut level) = (0_usize, true);
        for (time, next) in (0_u16..=u16::MAX).zip(levels) {
            if next != level {
                // One too many is found when they are read.
                let Some(edge) = edges.get_mut(count) else { return Err(ReplyError::Timing) };
                (*edge, level, count) = (time, next, count + 1);
            }
        }
        Self::from_edges(edges.get(..count).unwrap_or_default(), per_bit)
    }
}

/// Five bits for each four, none with more than two zeros in a row.
const GROUPS: [u32; 16] =
    [0x19, 0x1B, 0x12, 0x13, 0x1D, 0x15, 0x16, 0x17, 0x1A, 0x09, 0x0A, 0x0B, 0x1E, 0x0D, 0x0E, 0x0F];

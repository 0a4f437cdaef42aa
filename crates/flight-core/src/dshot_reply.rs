//! Replies of motor controllers on bidirectional DSHOT: what comes back over the motor's own wire after a frame.
//!
//! The idle line is high, and frames are inverted, with a complemented checksum
//! ([`DshotFrame::bidirectional`](crate::dshot::DshotFrame::bidirectional)). Some 30 us after one, a motor controller
//! answers with 21 bits at 5/4 of the frame's rate: a low start bit, then sixteen bits in groups of four, each group as
//! five bits of a group code (GCR) of which a one is a change of level. The sixteen bits are twelve of content and a
//! complemented checksum. The content is the period of an electrical revolution, or, between periods, another quantity
//! (extended telemetry, EDT).

/// Bits of a reply on the wire, the start bit included.
pub const REPLY_BITS: u32 = 21;
/// Changes of level in a reply, at most, the start bit's included.
pub const EDGES_MAX: usize = REPLY_BITS as usize + 1;

/// A reply's bits are to the frame's as these are to each other.
pub const RATE_RATIO: [u32; 2] = [5, 4];

/// A period that no rotor has: it stands.
const STOPPED: u16 = 0xFFF;
const US_PER_MINUTE: u32 = 60_000_000;

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

    /// Reads the replies on several lines from samples of all of them, `per_bit` in each bit of a reply: `lines` are
    /// the places of their bits in a sample, below 16. A noisy line takes no longer than a reply.
    pub fn from_port<const N: usize>(samples: &[u16], lines: [u8; N], per_bit: u16) -> [Result<Self, ReplyError>; N] {
        let lines = lines.map(|line| 1_u16.checked_shl(line.into()).unwrap_or_default());
        let mut edges = [[0_u16; EDGES_MAX]; N];
        let mut counts = [0_usize; N];
        // They rest high.
        let (mut last, mut open) = (u16::MAX, lines.iter().fold(0, |open, line| open | line));
        for (time, levels) in (0_u16..).zip(samples) {
            let changed = (levels ^ last) & open;
            last = *levels;
            if changed == 0 {
                continue;
            }
            for ((edges, count), line) in edges.iter_mut().zip(&mut counts).zip(lines) {
                if changed & line == 0 {
                    continue;
                }
                match edges.get_mut(*count) {
                    Some(edge) => (*edge, *count) = (time, *count + 1),
                    // More than a reply has.
                    None => (*count, open) = (0, open & !line),
                }
            }
            if open == 0 {
                break;
            }
        }
        let mut replies = [Err(ReplyError::Timing); N];
        for ((reply, edges), count) in replies.iter_mut().zip(&edges).zip(counts) {
            *reply = Self::from_edges(edges.get(..count).unwrap_or_default(), per_bit);
        }
        replies
    }

    /// Returns the electrical speed \[rev/min\] that it tells, if it does: a motor's times its pairs of poles.
    #[must_use]
    pub fn speed_rev_min(self) -> Option<u32> {
        match self {
            DshotReply::Period(None) => Some(0),
            DshotReply::Period(Some(period_us)) => US_PER_MINUTE.checked_div(period_us),
            _ => None,
        }
    }

    /// Returns the sixteen bits with which a motor controller replies for an electrical speed \[rev/min\].
    #[must_use]
    pub fn bits_of_speed(speed_rev_min: u32) -> u16 {
        let period_us = US_PER_MINUTE.checked_div(speed_rev_min).unwrap_or(u32::MAX);
        // The least exponent with which it fits into nine bits.
        let exponent = (u32::BITS - period_us.leading_zeros()).saturating_sub(9);
        let content = if exponent > 7 { STOPPED } else { (exponent << 9 | period_us >> exponent) as u16 };
        content << 4 | !(content ^ content >> 4 ^ content >> 8) & 0xF
    }

    /// Returns the levels of the line for sixteen bits, the start bit highest.
    #[must_use]
    pub fn line_of_bits(bits: u16) -> u32 {
        let nibbles = [12, 8, 4, 0].map(|at| usize::from(bits >> at & 0xF));
        let code = nibbles.iter().fold(0, |code, at| code << 5 | GROUPS.get(*at).copied().unwrap_or_default());
        // From the low start bit on, each one is a change.
        let (mut line, mut level) = (0, 0);
        for at in (0..REPLY_BITS - 1).rev() {
            level ^= code >> at & 1;
            line = line << 1 | level;
        }
        line
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

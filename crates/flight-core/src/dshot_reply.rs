//! Replies of motor controllers (ESCs) in bidirectional DSHOT, sent over the motor's own wire after each frame.
//!
//! The idle line is high, and frames are inverted, with a complemented checksum
//! ([`DshotFrame::bidirectional`](crate::dshot::DshotFrame::bidirectional)). About 30 us after a frame, the motor
//! controller replies with 21 bits at 5/4 of the frame's bit rate: a low start bit, then sixteen bits in groups of
//! four. Each group is sent as five bits of a group code (GCR), in which a one is a change of level. The sixteen bits
//! are twelve bits of content and a complemented checksum. The content is the period of an electrical revolution or,
//! between periods, another quantity (extended telemetry, EDT).

/// Number of bits in a reply, including the start bit.
pub const REPLY_BITS: u32 = 21;
/// Largest number of level changes in a reply, including the start bit's.
pub const EDGES_MAX: usize = REPLY_BITS as usize + 1;

/// Ratio of a reply's bit rate to the frame's.
pub const RATE_RATIO: [u32; 2] = [5, 4];

/// Content that reports a stopped motor.
const STOPPED: u16 = 0xFFF;
const US_PER_MINUTE: u32 = 60_000_000;

/// Content of a motor controller's reply.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DshotReply {
    /// Period of an electrical revolution \[us\]; `None` if the motor is stopped.
    Period(Option<u32>),
    /// Temperature \[deg C\].
    Temperature(u8),
    /// Supply voltage \[0.25 V\].
    Voltage(u8),
    /// Current \[A\].
    Current(u8),
    /// Other extended telemetry: its type, 4 to 6 for debugging and 7 for state and events, and its value. Type 0 is a
    /// period of zero, which no motor has.
    Other(u8, u8),
}

/// Reason why bits are not a valid reply.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReplyError {
    /// The line has changed too rarely, too often, or at times that fit no bit.
    Timing,
    /// Five bits are not a group of the code.
    Group,
    /// The checksum is wrong.
    Checksum,
}

impl DshotReply {
    /// Decodes the twelve bits of content.
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
            // A period has the highest bit of the mantissa set, or an exponent of 0. That tells it from telemetry.
            _ => DshotReply::Period(Some(mantissa << exponent)),
        }
    }

    /// Decodes a reply from its sixteen bits.
    ///
    /// # Errors
    /// A wrong checksum.
    pub const fn from_bits(bits: u16) -> Result<Self, ReplyError> {
        match (bits ^ (bits >> 4) ^ (bits >> 8) ^ (bits >> 12)) & 0xF {
            0xF => Ok(Self::of(bits >> 4)),
            _ => Err(ReplyError::Checksum),
        }
    }

    /// Decodes a reply from its twenty code bits, the first as the highest.
    ///
    /// # Errors
    /// The first fault found.
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

    /// Decodes a reply from the times of the line's level changes, in counts of a 16-bit timer that wraps. The first
    /// change is the start bit's. `bit_counts` is the length of a reply's bit, four fifths of a frame's. Bits may be
    /// too long or short by about a third. Changes after the reply's last bit are ignored.
    ///
    /// # Errors
    /// The first fault found.
    pub fn from_edges(edges: &[u16], bit_counts: u16) -> Result<Self, ReplyError> {
        let mut times = edges.iter();
        let (Some(mut last), 1..) = (times.next(), bit_counts) else { return Err(ReplyError::Timing) };
        let (mut code, mut at) = (0_u32, 0_u32);
        for time in times {
            let counts = u32::from(time.wrapping_sub(*last));
            // The divisor is not zero, since `bit_counts` was checked above.
            let bits = (counts + u32::from(bit_counts) / 2) / u32::from(bit_counts);
            if bits == 0 {
                return Err(ReplyError::Timing);
            }
            at = at.saturating_add(bits);
            if at >= REPLY_BITS {
                break;
            }
            // Shifts by 0 to 19. The start bit, at 0, is not part of the code.
            code |= 1 << (REPLY_BITS - 1 - at);
            last = time;
        }
        Self::from_code(code)
    }

    /// Decodes the replies on several lines of a port from samples of the port, taken `per_bit` times per reply bit.
    /// `lines` are the lines' bit positions in a sample, below 16. A noisy line takes no longer than a reply.
    pub fn from_port<const N: usize>(samples: &[u16], lines: [u8; N], per_bit: u16) -> [Result<Self, ReplyError>; N] {
        let lines = lines.map(|line| 1_u16.checked_shl(line.into()).unwrap_or_default());
        let mut edges = [[0_u16; EDGES_MAX]; N];
        let mut counts = [0_usize; N];
        // The idle lines are high.
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
                    // More changes than a reply has: ignore the line from now on.
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

    /// Returns the electrical speed \[rev/min\], if the reply has it. It is the motor's speed times its number of pole
    /// pairs.
    #[must_use]
    pub fn speed_rev_min(self) -> Option<u32> {
        match self {
            DshotReply::Period(None) => Some(0),
            DshotReply::Period(Some(period_us)) => US_PER_MINUTE.checked_div(period_us),
            _ => None,
        }
    }

    /// Returns the sixteen bits of a reply that reports an electrical speed \[rev/min\].
    #[must_use]
    pub fn bits_of_speed(speed_rev_min: u32) -> u16 {
        let period_us = US_PER_MINUTE.checked_div(speed_rev_min).unwrap_or(u32::MAX);
        // This is the smallest exponent for which the mantissa fits nine bits.
        let exponent = (u32::BITS - period_us.leading_zeros()).saturating_sub(9);
        let content = if exponent > 7 { STOPPED } else { (exponent << 9 | period_us >> exponent) as u16 };
        content << 4 | !(content ^ content >> 4 ^ content >> 8) & 0xF
    }

    /// Returns the line's levels for the sixteen bits of a reply. The start bit is the highest of the 21.
    #[must_use]
    pub fn line_of_bits(bits: u16) -> u32 {
        let nibbles = [12, 8, 4, 0].map(|at| usize::from(bits >> at & 0xF));
        let code = nibbles.iter().fold(0, |code, at| code << 5 | GROUPS.get(*at).copied().unwrap_or_default());
        // The start bit is low. From there on, each one is a level change.
        let (mut line, mut level) = (0, 0);
        for at in (0..REPLY_BITS - 1).rev() {
            level ^= code >> at & 1;
            line = line << 1 | level;
        }
        line
    }

    /// Decodes a reply from samples of the line at equal intervals, `per_bit` per reply bit.
    ///
    /// # Errors
    /// The first fault found.
    pub fn from_samples(levels: impl IntoIterator<Item = bool>, per_bit: u16) -> Result<Self, ReplyError> {
        let mut edges = [0_u16; EDGES_MAX];
        let (mut count, mut level) = (0_usize, true);
        for (time, next) in (0_u16..=u16::MAX).zip(levels) {
            if next != level {
                // Excess changes are found when the edges are decoded.
                let Some(edge) = edges.get_mut(count) else { return Err(ReplyError::Timing) };
                (*edge, level, count) = (time, next, count + 1);
            }
        }
        Self::from_edges(edges.get(..count).unwrap_or_default(), per_bit)
    }
}

/// Group code: five bits for each four, none with more than two zeros in a row.
const GROUPS: [u32; 16] =
    [0x19, 0x1B, 0x12, 0x13, 0x1D, 0x15, 0x16, 0x17, 0x1A, 0x09, 0x0A, 0x0B, 0x1E, 0x0D, 0x0E, 0x0F];

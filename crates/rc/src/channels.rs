//! Channels of a transmitter.

/// Number of channels: a receiver has 16, a ground station up to 18.
pub const CHANNELS: usize = 18;
/// Number of channels in a CRSF or SBUS frame.
pub(crate) const FRAMED: usize = 16;
/// Bits per channel in both protocols.
const BITS: usize = 11;
/// Bytes of the channels in a frame.
pub(crate) const PACKED: usize = FRAMED * BITS / 8;

/// RC channels as servo pulse lengths; 1500 us is the centre.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Channels {
    /// Pulse length; 0 for a missing channel \[us\].
    pub us: [u16; CHANNELS],
}

impl Channels {
    /// Returns the channels of a receiver's frame.
    pub fn of(framed_us: [u16; FRAMED]) -> Self {
        let mut us = [0; CHANNELS];
        us.iter_mut().zip(framed_us).for_each(|(to, from)| *to = from);
        Channels { us }
    }

    /// Unpacks channels of eleven bits each, lowest bits first; `to_us` converts a raw value to microseconds.
    pub(crate) fn unpack(bytes: &[u8; PACKED], to_us: fn(u16) -> u16) -> Self {
        let mut us = [0; FRAMED];
        let (mut bits, mut held, mut bytes) = (0u32, 0, bytes.iter());
        for channel in &mut us {
            while held < BITS {
                // Never more than 18 bits are held.
                bits |= u32::from(bytes.next().copied().unwrap_or_default()) << held;
                held += 8;
            }
            *channel = to_us((bits & ((1 << BITS) - 1)) as u16);
            bits >>= BITS;
            held -= BITS;
        }
        Channels::of(us)
    }

    /// Packs the channels, the inverse of [`unpack`](Self::unpack).
    pub(crate) fn pack(&self, from_us: fn(u16) -> u16) -> [u8; PACKED] {
        let mut packed = [0; PACKED];
        let (mut bits, mut held, mut channels) = (0u32, 0, self.us.iter().take(FRAMED));
        for byte in &mut packed {
            while held < 8 {
                let channel = channels.next().map_or(0, |us| from_us(*us));
                bits |= u32::from(channel & ((1 << BITS) - 1)) << held;
                held += BITS;
            }
            *byte = bits as u8;
            bits >>= 8;
            held -= 8;
        }
        packed
    }

    /// Returns a channel by number, counted from 1 as in parameters. Returns none for number 0 and for a missing
    /// channel.
    pub fn channel(&self, number: u32) -> Option<u16> {
        let index = usize::try_from(number).ok()?.checked_sub(1)?;
        self.us.get(index).copied().filter(|us| *us != 0)
    }
}

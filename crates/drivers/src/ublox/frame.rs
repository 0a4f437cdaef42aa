//! UBX frames: two sync bytes, class, id, payload length, payload, and Fletcher's checksum over everything after the
//! sync bytes.

/// Longest accepted payload: a version with ten extensions. Configured receivers send no longer one, so a longer length
/// is noise. A damaged length thus delays the following frames by a third of a second at most.
pub(super) const PAYLOAD_MAX: usize = 340;
const BEGIN: [u8; 2] = [0xB5, 0x62];
/// Bytes of a frame without its payload.
const AROUND: usize = 8;
/// Pause within a frame after which the frame is abandoned \[us\].
const PAUSE_US: u64 = 200_000;

/// Class and id of a message.
pub(super) type MessageId = [u8; 2];

/// A UBX frame to be sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UbxCommand {
    bytes: [u8; UbxCommand::LENGTH_MAX],
    length: usize,
}

impl UbxCommand {
    /// Longest command \[bytes\].
    pub const LENGTH_MAX: usize = Self::PAYLOAD_MAX + AROUND;
    /// Longest payload of a command \[bytes\].
    const PAYLOAD_MAX: usize = 36;

    /// Creates a command with this payload of at most 36 bytes.
    pub(super) fn new(id: MessageId, payload: &[u8]) -> Self {
        let length = payload.len().min(Self::PAYLOAD_MAX) as u16;
        let summed = id.into_iter().chain(length.to_le_bytes()).chain(payload.iter().copied().take(length.into()));
        let sum = checksum(summed.clone());
        let mut command = UbxCommand { bytes: [0; Self::LENGTH_MAX], length: usize::from(length) + AROUND };
        command.bytes.iter_mut().zip(BEGIN.into_iter().chain(summed).chain(sum)).for_each(|(to, from)| *to = from);
        command
    }

    /// Returns the frame's bytes.
    #[must_use]
    pub fn as_bytes(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or_default()
    }

    /// Returns class and id.
    pub(super) fn id(&self) -> MessageId {
        let [_, _, class, number, ..] = self.bytes;
        [class, number]
    }
}

/// Returns Fletcher's 8-bit checksum (RFC 1145).
fn checksum(bytes: impl Iterator<Item = u8>) -> [u8; 2] {
    bytes.fold([0, 0], |[a, b]: [u8; 2], byte| {
        let a = a.wrapping_add(byte);
        [a, b.wrapping_add(a)]
    })
}

/// Content at the beginning of the buffer.
enum FrameSearch<T> {
    /// Incomplete frame.
    Part,
    /// This number of bytes of noise.
    Noise(usize),
    /// A frame with a wrong checksum.
    Damaged,
    /// A complete frame with its length and decoded message.
    Whole(usize, T),
}

/// Finds frames in a stream of bytes.
pub(super) struct FrameDecoder {
    bytes: [u8; PAYLOAD_MAX + AROUND],
    length: usize,
    /// Arrival times of the first and the newest byte in the buffer \[us\].
    first_us: u64,
    newest_us: u64,
    damaged: u32,
}

impl FrameDecoder {
    pub(super) const NEW: Self =
        FrameDecoder { bytes: [0; PAYLOAD_MAX + AROUND], length: 0, first_us: 0, newest_us: 0, damaged: 0 };

    /// Returns the number of frames with a wrong checksum.
    pub(super) fn damaged(&self) -> u32 {
        self.damaged
    }

    /// Appends a byte.
    pub(super) fn push(&mut self, at_us: u64, byte: u8) {
        if at_us.saturating_sub(self.newest_us) > PAUSE_US {
            self.length = 0;
        }
        if self.length == 0 {
            self.first_us = at_us;
        }
        self.newest_us = at_us;
        // The buffer cannot overflow, because `next` removes anything as long as the longest frame.
        if let Some(place) = self.bytes.get_mut(self.length) {
            *place = byte;
            self.length += 1;
        }
    }

    /// Decodes the next complete frame with `read`; returns it with the arrival time of its first byte. `byte_us` is
    /// the time of one byte. To be called after each byte until it returns none.
    pub(super) fn next<T>(&mut self, byte_us: u64, read: impl Fn(MessageId, &[u8]) -> T) -> Option<(u64, T)> {
        loop {
            match front(self.bytes.get(..self.length)?, &read) {
                FrameSearch::Part => return None,
                FrameSearch::Noise(count) => self.remove(count, byte_us),
                FrameSearch::Damaged => {
                    self.damaged = self.damaged.saturating_add(1);
                    // Another frame may begin within it.
                    self.remove(BEGIN.len(), byte_us);
                }
                FrameSearch::Whole(length, message) => {
                    let first_us = self.first_us;
                    self.remove(length, byte_us);
                    return Some((first_us, message));
                }
            }
        }
    }

    fn remove(&mut self, count: usize, byte_us: u64) {
        if let Some(held) = self.bytes.get_mut(..self.length) {
            let count = count.min(held.len());
            held.rotate_left(count);
            self.length -= count;
        }
        // Bytes have no times of their own: the remaining ones are assumed to have arrived back to back.
        self.first_us = self.newest_us.saturating_sub(byte_us * self.length.saturating_sub(1) as u64);
    }
}

fn front<T>(held: &[u8], read: impl Fn(MessageId, &[u8]) -> T) -> FrameSearch<T> {
    let [begin, _] = BEGIN;
    match held {
        [] => FrameSearch::Part,
        [a] if *a == begin => FrameSearch::Part,
        [a, b, rest @ ..] if [*a, *b] == BEGIN => {
            let [class, number, low, high, rest @ ..] = rest else { return FrameSearch::Part };
            let length = usize::from(u16::from_le_bytes([*low, *high]));
            if length > PAYLOAD_MAX {
                return FrameSearch::Noise(BEGIN.len());
            }
            let Some((payload, [a, b, ..])) = rest.split_at_checked(length) else { return FrameSearch::Part };
            let summed = [*class, *number, *low, *high].into_iter().chain(payload.iter().copied());
            if checksum(summed) == [*a, *b] {
                FrameSearch::Whole(length + AROUND, read([*class, *number], payload))
            } else {
                FrameSearch::Damaged
            }
        }
        [_, rest @ ..] => {
            let next = rest.iter().position(|byte| *byte == begin).unwrap_or(rest.len());
            FrameSearch::Noise(1 + next)
        }
    }
}

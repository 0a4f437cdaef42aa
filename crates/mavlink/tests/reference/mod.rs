//! Reference decoder for comparison with `afbc_mavlink::Decoder`. It finds the frames of a whole stream at once. It was
//! written only from MAVLink's specification (<https://mavlink.io/en/guide/serialization.html>) and the rules in the
//! decoder's documentation.

/// A frame with a correct checksum.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// Incompatibility flags.
    pub flags: u8,
    pub sequence: u8,
    pub system: u8,
    pub component: u8,
    pub id: u32,
    pub payload: Vec<u8>,
}

/// Computes the CRC-16/MCRF4XX bit by bit.
pub fn crc(bytes: impl IntoIterator<Item = u8>) -> u16 {
    bytes.into_iter().fold(0xFFFF, |crc, byte| {
        (0..8).fold(crc ^ u16::from(byte), |crc, _| if crc & 1 == 1 { (crc >> 1) ^ 0x8408 } else { crc >> 1 })
    })
}

impl Frame {
    /// Returns the frame's bytes; a signature is filled with arbitrary bytes.
    pub fn bytes(&self, seed: u8) -> Vec<u8> {
        let Frame { flags, sequence, system, component, id, payload } = self;
        let mut bytes = vec![0xFD, payload.len() as u8, *flags, 0, *sequence, *system, *component];
        bytes.extend_from_slice(&id.to_le_bytes()[..3]);
        bytes.extend_from_slice(payload);
        let sum = crc(bytes[1..].iter().copied().chain([seed]));
        bytes.extend_from_slice(&sum.to_le_bytes());
        bytes.extend_from_slice(&[0xA5; 13][..if flags & 1 == 1 { 13 } else { 0 }]);
        bytes
    }

    /// Returns the end of a frame that begins at `at`; none if its header is incomplete.
    fn end(stream: &[u8], at: usize) -> Option<usize> {
        let header = stream.get(at..at + 10)?;
        Some(at + 10 + usize::from(header[1]) + 2 + if header[2] & 1 == 1 { 13 } else { 0 })
    }

    /// Returns the frame at `at`, if it is complete and its checksum is correct.
    fn read(stream: &[u8], at: usize, seed: &impl Fn(u32) -> Option<u8>) -> Option<Self> {
        let frame = stream.get(at..Self::end(stream, at)?)?;
        let id = u32::from_le_bytes([frame[7], frame[8], frame[9], 0]);
        let payload = &frame[10..10 + usize::from(frame[1])];
        let sum = crc(frame[1..10 + payload.len()].iter().copied().chain([seed(id)?]));
        let right = frame[10 + payload.len()..][..2] == sum.to_le_bytes();
        let payload = payload.to_vec();
        right.then(|| Frame { flags: frame[2], sequence: frame[4], system: frame[5], component: frame[6], id, payload })
    }
}

/// True if `stream` contains a frame with a correct checksum that nobody sent, which crosses one of the `joints`
/// between sent pieces. A 16-bit checksum is correct by chance once in 65,536 times.
pub fn any_by_chance(stream: &[u8], joints: &[usize], seed: impl Fn(u32) -> Option<u8>) -> bool {
    (0..stream.len()).filter(|&at| stream[at] == 0xFD).any(|at| {
        let end = Frame::end(stream, at).unwrap_or(at);
        joints.iter().any(|&joint| at < joint && joint < end) && Frame::read(stream, at, &seed).is_some()
    })
}

/// Returns all frames of `stream` with a correct checksum that are not within another frame. `seed` returns a message's
/// `CRC_EXTRA`, if known.
pub fn frames(stream: &[u8], seed: impl Fn(u32) -> Option<u8>) -> Vec<Frame> {
    // `at` is the position, `sealed` the end of the last frame that could not be verified, and `known` the number of
    // bytes needed for the decisions so far.
    let (mut at, mut sealed, mut known) = (0, 0, 0);
    let mut frames = Vec::new();
    while at < stream.len() {
        known = known.max(at + 1);
        if stream[at] != 0xFD {
            at += 1;
            continue;
        }
        let Some(end) = Frame::end(stream, at) else {
            // The end of the stream cuts off the header; the rest is shorter than a frame.
            break;
        };
        known = known.max(at + 10);
        if end <= sealed {
            at += 1;
            continue;
        }
        // A frame may begin here and another after the skipped bytes. The frame that is complete first counts.
        if at < sealed
            && let Some(other) = Frame::end(stream, sealed)
            && (known..end).contains(&other)
            && let Some(frame) = Frame::read(stream, sealed, &seed)
        {
            frames.push(frame);
            (at, known) = (other, other);
            continue;
        }
        if end > stream.len() {
            break;
        }
        known = known.max(end);
        if let Some(frame) = Frame::read(stream, at, &seed) {
            frames.push(frame);
            at = end;
        } else if at < sealed {
            at += 1;
        } else {
            let Some(&next) = stream.get(end) else { break };
            known = known.max(end + 1);
            if next == 0xFD {
                sealed = end;
            }
            at += 1;
        }
    }
    frames
}

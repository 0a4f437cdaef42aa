//! Decoding of a byte stream into messages.

use crate::address::Address;
use crate::framing::{FrameHeader, HEADER, SIGNED, SIGNED_FRAME_MAX, START, checksum};
use crate::message::{FrameFault, MessageSet};
use crate::signature::ReceivedFrame;
use core::marker::PhantomData;
use mavlink::Message as _;
use mavlink::dialects::common::MavMessage;

/// Reception counts since power-up. Each count stops at `u32::MAX`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Messages delivered.
    pub received: u32,
    /// Frames dropped for [`FrameFault::BadChecksum`].
    pub bad_checksum: u32,
    /// Frames dropped for [`FrameFault::Unknown`], or bytes that looked like the start of such a frame.
    pub unknown: u32,
    /// Frames dropped for [`FrameFault::Malformed`].
    pub malformed: u32,
    /// Frames dropped for [`FrameFault::Implausible`].
    pub implausible: u32,
    /// Frames dropped for [`FrameFault::Unsupported`].
    pub unsupported: u32,
    /// Frames dropped for [`FrameFault::Elsewhere`].
    pub elsewhere: u32,
    /// Bytes outside all frames with a correct checksum.
    pub skipped_bytes: u32,
    /// Frames that are missing from the sequence numbers of a sender: lost, or with a wrong or unknown checksum.
    pub lost: u32,
}

impl Counters {
    /// Returns all counts in the order of the fields.
    pub(crate) fn to_array(self) -> [u32; 9] {
        let Counters { received, bad_checksum, unknown, malformed, implausible, .. } = self;
        let Counters { unsupported, elsewhere, skipped_bytes, lost, .. } = self;
        [received, bad_checksum, unknown, malformed, implausible, unsupported, elsewhere, skipped_bytes, lost]
    }

    /// Restores the counts from [`Counters::to_array`].
    pub(crate) fn from_array(counts: [u32; 9]) -> Self {
        let [received, bad_checksum, unknown, malformed, implausible, unsupported, elsewhere, skipped_bytes, lost] =
            counts;
        Counters {
            received,
            bad_checksum,
            unknown,
            malformed,
            implausible,
            unsupported,
            elsewhere,
            skipped_bytes,
            lost,
        }
    }

    /// Adds what a decoder has counted, whose counts were `before` and are `now`.
    pub fn add_since(&mut self, before: &Counters, now: &Counters) {
        let mut counts = self.to_array();
        for (count, (before, now)) in counts.iter_mut().zip(before.to_array().into_iter().zip(now.to_array())) {
            add(count, now.saturating_sub(before));
        }
        *self = Self::from_array(counts);
    }

    fn count(&mut self, fault: FrameFault) {
        let counter = match fault {
            FrameFault::BadChecksum => &mut self.bad_checksum,
            FrameFault::Unknown => &mut self.unknown,
            FrameFault::Malformed => &mut self.malformed,
            FrameFault::Implausible => &mut self.implausible,
            FrameFault::Unsupported => &mut self.unsupported,
            FrameFault::Elsewhere => &mut self.elsewhere,
        };
        add(counter, 1);
    }
}

fn add(counter: &mut u32, count: u32) {
    *counter = counter.saturating_add(count);
}

/// Decodes the messages of one direction from a stream.
///
/// # What is delivered
/// The decoder delivers frames of messages that the direction carries, if they have a correct checksum and are
/// accepted. [`Decoder::feed`] accepts frames without a signature. Additional fields at the end of a message, from a
/// newer dialect, are ignored.
///
/// # Frames within frames
/// Frames may contain frames for other systems: TUNNEL, FILE_TRANSFER_PROTOCOL, LOG_DATA. Nothing is delivered from
/// within
///
/// 1. a frame with a correct checksum, whatever follows it. The checksum can be verified for every message of MAVLink's
///    `common` dialect, carried or not, signed or not, of any length and to any target;
/// 2. any other frame, of another dialect or with a wrong checksum, if a start byte follows it.
///
/// If anything else follows, the frame's start byte counts as noise: it is skipped, and the search goes on after it. No
/// decoder can distinguish a frame whose first bytes were damaged from noise before the frames that it contains.
/// MAVLink 1 frames are noise.
///
/// # Effect of noise
/// A stray start byte seems to announce a frame. It delays the following bytes until all of that frame and one more
/// byte have arrived: at most 281 bytes, 3.1 ms of a busy line at 921,600 baud. It costs frames only if the last of
/// these bytes happens to be a start byte (rule 2), and then only frames that lie completely within the announced one;
/// a frame that extends beyond it is delivered. So every frame that begins at least 280 bytes after the last noise
/// arrives.
///
/// A truncated frame is noise, too. If its last byte is missing and was 0xFD, the first byte of the next frame
/// completes it, and the rest of the next frame is noise.
///
/// A 16-bit checksum accepts one of 65,536 damaged frames, as always in MAVLink.
///
/// In a stream without noise nothing is lost, and a frame that can be verified is delivered with its last byte. Several
/// frames in a row that cannot be verified and contain start bytes may delay the next one as above.
///
/// # Cost
/// Memory for the longest frame and one byte. In a stream of intact frames, each byte costs a copy and one step of the
/// checksum. In general, each byte costs three steps for each start byte among the 280 bytes before it. In the worst
/// case, all of these steps are due at once.
pub struct Decoder<M> {
    receiver: Address,
    buffer: [u8; HELD_MAX],
    length: usize,
    /// Number of bytes needed in the buffer before the next decision.
    needed: usize,
    /// Number of bytes at the front of the buffer that belong to a frame whose content is skipped (rule 2).
    sealed: usize,
    /// Sender and sequence number of the last frame.
    last: Option<(Address, u8)>,
    counters: Counters,
    is_wired: bool,
    messages: PhantomData<fn() -> M>,
}

/// Size of the longest frame and the byte after it.
const HELD_MAX: usize = SIGNED_FRAME_MAX + 1;

/// Content at the front of the buffer.
enum FrameScan<M> {
    /// Nothing can be decided until the buffer has this number of bytes.
    Incomplete(usize),
    /// Bytes that are no frame, or a frame to be skipped with this fault.
    Garbage(Option<FrameFault>),
    /// A frame of `length` bytes that is damaged or cannot be verified, followed by a start byte.
    Opaque { length: usize, fault: FrameFault },
    /// A frame with a correct checksum, which begins after `skipped` bytes.
    Intact { skipped: usize, header: FrameHeader, message: Result<M, FrameFault> },
}

/// Handler of the frames that a [`Decoder`] finds in its stream.
pub trait FrameHandler<M> {
    /// Returns true if the frame is accepted. Called once for each valid frame that the direction carries; refused ones
    /// count as [`FrameFault::Unsupported`].
    fn accepts(&mut self, frame: &ReceivedFrame<'_>) -> bool;

    /// Handles an accepted frame's message, with the address of its sender and its payload.
    fn handle(&mut self, from: Address, message: M, payload: &[u8]);
}

/// In a pair of closures, the first accepts frames, and the second handles their messages.
impl<M, A: FnMut(&ReceivedFrame<'_>) -> bool, H: FnMut(Address, M, &[u8])> FrameHandler<M> for (A, H) {
    fn accepts(&mut self, frame: &ReceivedFrame<'_>) -> bool {
        (self.0)(frame)
    }

    fn handle(&mut self, from: Address, message: M, payload: &[u8]) {
        (self.1)(from, message, payload);
    }
}

impl<M: MessageSet> Decoder<M> {
    /// Creates a decoder of messages to `receiver`.
    pub fn new(receiver: Address) -> Self {
        Decoder {
            receiver,
            buffer: [0; HELD_MAX],
            length: 0,
            needed: 1,
            sealed: 0,
            last: None,
            counters: Counters::default(),
            is_wired: false,
            messages: PhantomData,
        }
    }

    /// Returns the decoder for a stream over a wire. Whoever sends over a wire has the vehicle at hand, and is trusted
    /// more.
    #[must_use]
    pub fn wired(self) -> Self {
        Decoder { is_wired: true, ..self }
    }

    /// True if the stream comes over a wire.
    pub fn is_wired(&self) -> bool {
        self.is_wired
    }

    /// Takes the next bytes of the stream. Delivers every message that they complete, with its sender, unless its frame
    /// is signed.
    pub fn feed(&mut self, bytes: &[u8], deliver: impl FnMut(Address, M)) {
        self.feed_accepted(bytes, |frame| frame.stamp().is_none(), deliver);
    }

    /// Takes bytes like [`feed`](Self::feed), but delivers the frames that `accept` accepts. `accept` is called once
    /// for each valid frame that the direction carries; refused ones count as [`FrameFault::Unsupported`].
    pub fn feed_accepted(
        &mut self,
        bytes: &[u8],
        accept: impl FnMut(&ReceivedFrame<'_>) -> bool,
        mut deliver: impl FnMut(Address, M),
    ) {
        self.feed_to(&mut (accept, |from, message, _: &[u8]| deliver(from, message)), bytes);
    }

    /// Takes bytes like [`feed_accepted`](Self::feed_accepted); `handler` decides about each frame and gets the message
    /// with its payload.
    pub fn feed_to(&mut self, handler: &mut impl FrameHandler<M>, bytes: &[u8]) {
        for &byte in bytes {
            // The buffer cannot overflow, because `advance` always removes something from a full buffer.
            if let Some(next) = self.buffer.get_mut(self.length) {
                *next = byte;
                self.length += 1;
            }
            if self.length >= self.needed {
                self.advance(handler);
            }
        }
    }

    /// Returns the counts so far.
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Processes everything in the buffer that can be decided.
    fn advance(&mut self, handler: &mut impl FrameHandler<M>) {
        loop {
            match self.front() {
                FrameScan::Incomplete(needed) => {
                    self.needed = needed;
                    return;
                }
                FrameScan::Garbage(fault) => {
                    fault.into_iter().for_each(|fault| self.counters.count(fault));
                    self.skip_to_start();
                }
                FrameScan::Opaque { length, fault } => {
                    self.counters.count(fault);
                    self.sealed = length;
                    self.skip_to_start();
                }
                FrameScan::Intact { skipped, header, message } => {
                    add(&mut self.counters.skipped_bytes, skipped as u32);
                    // `accepts` may check the signature, which costs a hash, so it is called only for valid messages.
                    let message = message.and_then(|message| {
                        let frame = self.buffer.get(skipped..skipped + header.frame_length()).unwrap_or_default();
                        let frame = ReceivedFrame::new(header.from, header.id, frame, header.unsigned_length());
                        if handler.accepts(&frame) { Ok(message) } else { Err(FrameFault::Unsupported) }
                    });
                    self.count_lost(&header);
                    match message {
                        Ok(message) => {
                            add(&mut self.counters.received, 1);
                            let begin = skipped + HEADER;
                            let payload = self.buffer.get(begin..begin + usize::from(header.length));
                            handler.handle(header.from, message, payload.unwrap_or_default());
                        }
                        Err(fault) => self.counters.count(fault),
                    }
                    self.remove(skipped + header.frame_length());
                }
            }
        }
    }

    fn front(&self) -> FrameScan<M> {
        let held = self.buffer.get(..self.length).unwrap_or_default();
        match held.first() {
            None => return FrameScan::Incomplete(1),
            Some(&START) => {}
            Some(_) => return FrameScan::Garbage(None),
        }
        let Some(header) = held.first_chunk().map(FrameHeader::read) else { return FrameScan::Incomplete(HEADER) };
        let length = header.frame_length();
        // The frame would lie completely within a skipped frame, from which nothing is delivered.
        if length <= self.sealed {
            return FrameScan::Garbage(None);
        }
        let Some(frame) = held.get(..length) else { return self.behind_sealed(held, length) };
        if let Some(message) = self.read(frame, &header) {
            return FrameScan::Intact { skipped: 0, header, message };
        }
        // Content of a skipped frame that is not a frame is no fault.
        if self.sealed > 0 {
            return FrameScan::Garbage(None);
        }
        let fault = if M::format(header.id).is_some() { FrameFault::BadChecksum } else { FrameFault::Unknown };
        // The byte after the frame decides: without a verified checksum, only a following start byte makes it a frame.
        match held.get(length) {
            None => FrameScan::Incomplete(length + 1),
            Some(&START) => FrameScan::Opaque { length, fault },
            Some(_) => FrameScan::Garbage(Some(fault)),
        }
    }

    /// Decides about an incomplete frame of `length` bytes at the front of the buffer. Within a skipped frame, it may
    /// extend beyond that frame, or be mere content. If the frame after the skipped bytes is complete and intact, it is
    /// mere content.
    fn behind_sealed(&self, held: &[u8], length: usize) -> FrameScan<M> {
        if self.sealed == 0 {
            return FrameScan::Incomplete(length);
        }
        let behind = held.get(self.sealed..).unwrap_or_default();
        let header = behind.first_chunk().map(FrameHeader::read).filter(|header| header.frame_length() == behind.len());
        let read = header.and_then(|header| Some((header, self.read(behind, &header)?)));
        let incomplete = FrameScan::Incomplete(held.len() + 1);
        read.map_or(incomplete, |(header, message)| FrameScan::Intact { skipped: self.sealed, header, message })
    }

    /// Returns the message in `frame` if the frame's checksum can be verified and is correct.
    fn read(&self, frame: &[u8], header: &FrameHeader) -> Option<Result<M, FrameFault>> {
        let end = HEADER + usize::from(header.length);
        let (summed, payload) = (frame.get(1..end)?, frame.get(HEADER..end)?);
        let sent = frame.get(end..)?.first_chunk().copied().map(u16::from_le_bytes)?;
        let format = M::format(header.id);
        let extra_crc = format.map(|format| format.extra_crc).or_else(|| dialect_extra_crc(header.id))?;
        // The checksum is verified first, so that the content of an unsupported frame is not searched for frames.
        (checksum(summed, extra_crc) == sent).then(|| match format {
            None => Err(FrameFault::Unknown),
            Some(_) if header.incompatible & !SIGNED != 0 => Err(FrameFault::Unsupported),
            // Cuts off fields that a newer dialect has appended.
            Some(format) => M::read(header.id, payload.get(..format.length_max).unwrap_or(payload), self.receiver),
        })
    }

    /// Skips the first byte and everything up to the next start byte.
    fn skip_to_start(&mut self) {
        let held = self.buffer.get(..self.length).unwrap_or_default();
        let skipped = 1 + held.iter().skip(1).take_while(|&&byte| byte != START).count();
        add(&mut self.counters.skipped_bytes, skipped as u32);
        self.remove(skipped);
    }

    /// Removes the first `count` bytes of the buffer.
    fn remove(&mut self, count: usize) {
        if let Some(held) = self.buffer.get_mut(..self.length) {
            let count = count.min(held.len());
            held.copy_within(count.., 0);
            self.length -= count;
            self.sealed = self.sealed.saturating_sub(count);
        }
    }

    /// Counts the gap in the sequence numbers before a frame. Out-of-order and duplicate frames leave no gap.
    fn count_lost(&mut self, header: &FrameHeader) {
        let gap = match self.last {
            Some((from, sequence)) if from == header.from => header.sequence.wrapping_sub(sequence).wrapping_sub(1),
            _ => 0,
        };
        // Sequence numbers have 8 bits: a difference of 128 or more means an older frame.
        if gap < 128 {
            add(&mut self.counters.lost, u32::from(gap));
            self.last = Some((header.from, header.sequence));
        }
    }
}

/// Returns the checksum's seed for a message of the `common` dialect; none for other messages.
fn dialect_extra_crc(id: u32) -> Option<u8> {
    /// Id of the only message with the seed 0, which otherwise means "not in the dialect".
    const COMPONENT_INFORMATION: u32 = 395;
    match MavMessage::extra_crc(id) {
        0 if id != COMPONENT_INFORMATION => None,
        extra_crc => Some(extra_crc),
    }
}

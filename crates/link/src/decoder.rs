//! From a stream of bytes to messages.

use crate::address::Address;
use crate::framing::{HEADER, Header, SIGNED_MAX, START, checksum};
use crate::message::{Fault, Message};
use core::marker::PhantomData;
use mavlink::Message as _;
use mavlink::dialects::common::MavMessage;

/// What came in since power-up. Each count stops at `u32::MAX`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Messages delivered.
    pub received: u32,
    /// Frames dropped for [`Fault::BadChecksum`].
    pub bad_checksum: u32,
    /// Frames dropped for [`Fault::Unknown`], or bytes that looked like their beginning.
    pub unknown: u32,
    /// Frames dropped for [`Fault::Oversized`].
    pub oversized: u32,
    /// Frames dropped for [`Fault::Malformed`].
    pub malformed: u32,
    /// Frames dropped for [`Fault::Implausible`].
    pub implausible: u32,
    /// Frames dropped for [`Fault::Unsupported`].
    pub unsupported: u32,
    /// Frames dropped for [`Fault::Elsewhere`].
    pub elsewhere: u32,
    /// Bytes that belonged to no frame whose checksum was right.
    pub skipped_bytes: u32,
    /// Frames that did not arrive, or whose checksum was wrong or could not be checked, by the gaps between one sender's
    /// sequence numbers.
    pub lost: u32,
}

impl Counters {
    /// All counts, in the order of the fields.
    pub(crate) fn to_array(self) -> [u32; 10] {
        let Counters { received, bad_checksum, unknown, oversized, malformed, implausible, .. } = self;
        let Counters { unsupported, elsewhere, skipped_bytes, lost, .. } = self;
        [
            received,
            bad_checksum,
            unknown,
            oversized,
            malformed,
            implausible,
            unsupported,
            elsewhere,
            skipped_bytes,
            lost,
        ]
    }

    /// The counts that [`Counters::to_array`] gave.
    pub(crate) fn from_array(counts: [u32; 10]) -> Self {
        let [
            received,
            bad_checksum,
            unknown,
            oversized,
            malformed,
            implausible,
            unsupported,
            elsewhere,
            skipped_bytes,
            lost,
        ] = counts;
        Counters {
            received,
            bad_checksum,
            unknown,
            oversized,
            malformed,
            implausible,
            unsupported,
            elsewhere,
            skipped_bytes,
            lost,
        }
    }

    fn count(&mut self, fault: Fault) {
        let counter = match fault {
            Fault::BadChecksum => &mut self.bad_checksum,
            Fault::Unknown => &mut self.unknown,
            Fault::Oversized => &mut self.oversized,
            Fault::Malformed => &mut self.malformed,
            Fault::Implausible => &mut self.implausible,
            Fault::Unsupported => &mut self.unsupported,
            Fault::Elsewhere => &mut self.elsewhere,
        };
        add(counter, 1);
    }
}

fn add(counter: &mut u32, count: u32) {
    *counter = counter.saturating_add(count);
}

/// Reads messages of one direction from a stream.
///
/// # What is delivered
/// A frame of a message that the direction carries, unsigned, no longer than the message, with the right checksum.
///
/// # What is not looked into
/// Frames may carry other frames, meant for somebody else: TUNNEL, FILE_TRANSFER_PROTOCOL, LOG_DATA. Nothing is
/// delivered from within
///
/// 1. a frame whose checksum is right, whatever comes behind it. That can be told of every message of MAVLink's
///    `common` dialect, carried or not, signed or not, of any length and for anyone;
/// 2. any other frame, of another dialect or with a wrong checksum, if a start byte follows it.
///
/// If something else follows, then its own start byte was none, as far as anyone can tell: it is skipped, and the search
/// goes on behind it. No decoder can tell a frame whose first bytes were damaged from noise before the frames that it
/// carries. MAVLink 1 is noise.
///
/// # What noise costs
/// A stray start byte holds back what comes after it until as many bytes are there as it announces, and one more: at
/// most 281 bytes, 3.1 ms of a busy line at 921,600 baud. Frames are lost to it only if the last of these happens to be a
/// start byte (rule 2), and then only those that lie wholly within the others: one that reaches beyond them is delivered.
/// So every frame arrives that begins 280 bytes or more behind the last noise.
///
/// A truncated frame is such noise. One that lacks its last byte, if that was 0xFD, is completed by the first byte of the
/// next frame, and then the rest of that one is noise.
///
/// A checksum of 16 bits takes one of 65,536 damaged frames for a whole one, as MAVLink's always does.
///
/// In a stream without noise nothing is lost, and what can be checked is delivered with its last byte; unless several
/// frames in a row cannot be checked and hold start bytes, which may hold it back as above.
///
/// # Cost
/// Memory for the longest frame and a byte more. In a stream of intact frames a byte costs a copy and a step of its
/// frame's checksum; in general, three steps for each start byte among the 280 bytes before it. At worst all of these
/// fall due at once.
pub struct Decoder<M> {
    receiver: Address,
    buffer: [u8; HELD_MAX],
    length: usize,
    /// How many bytes at the front of the buffer belong to a frame that is not looked into (rule 2).
    sealed: usize,
    /// Sender and sequence number of the last frame.
    last: Option<(Address, u8)>,
    counters: Counters,
    messages: PhantomData<fn() -> M>,
}

/// The longest frame, and the byte behind it.
const HELD_MAX: usize = SIGNED_MAX + 1;

/// What the bytes held begin with.
enum Front<M> {
    /// Nothing yet, or too little to tell.
    Incomplete,
    /// No frame, or one that is not looked at.
    Garbage(Option<Fault>),
    /// A frame of `length` bytes that cannot be checked, or is damaged, and a start byte behind it.
    Opaque { length: usize, fault: Fault },
    /// A frame whose checksum is right, which begins behind the first `skipped` bytes.
    Intact { skipped: usize, header: Header, message: Result<M, Fault> },
}

impl<M: Message> Decoder<M> {
    /// Reads in the name of `receiver`.
    pub fn new(receiver: Address) -> Self {
        Decoder {
            receiver,
            buffer: [0; HELD_MAX],
            length: 0,
            sealed: 0,
            last: None,
            counters: Counters::default(),
            messages: PhantomData,
        }
    }

    /// Takes the next bytes of the stream and hands over every message that they complete, with its sender.
    pub fn feed(&mut self, bytes: &[u8], mut deliver: impl FnMut(Address, M)) {
        for &byte in bytes {
            // There is room: `advance` empties a full buffer, which tells of any frame.
            if let Some(next) = self.buffer.get_mut(self.length) {
                *next = byte;
                self.length += 1;
            }
            self.advance(&mut deliver);
        }
    }

    /// What came in so far.
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Deals with everything in the buffer that can be told.
    fn advance(&mut self, deliver: &mut impl FnMut(Address, M)) {
        loop {
            match self.front() {
                Front::Incomplete => return,
                Front::Garbage(fault) => {
                    fault.into_iter().for_each(|fault| self.counters.count(fault));
                    self.skip_to_start();
                }
                Front::Opaque { length, fault } => {
                    self.counters.count(fault);
                    self.sealed = length;
                    self.skip_to_start();
                }
                Front::Intact { skipped, header, message } => {
                    add(&mut self.counters.skipped_bytes, skipped as u32);
                    self.remove(skipped + header.frame_length());
                    self.count_lost(&header);
                    match message {
                        Ok(message) => {
                            add(&mut self.counters.received, 1);
                            deliver(header.from, message);
                        }
                        Err(fault) => self.counters.count(fault),
                    }
                }
            }
        }
    }

    fn front(&self) -> Front<M> {
        let held = self.buffer.get(..self.length).unwrap_or_default();
        match held.first() {
            None => return Front::Incomplete,
            Some(&START) => {}
            Some(_) => return Front::Garbage(None),
        }
        let Some(header) = held.first_chunk().map(Header::read) else { return Front::Incomplete };
        let length = header.frame_length();
        if length <= self.sealed {
            return Front::Garbage(None);
        }
        let Some(frame) = held.get(..length) else { return self.behind_sealed(held) };
        if let Some(message) = self.read(frame, &header) {
            return Front::Intact { skipped: 0, header, message };
        }
        if self.sealed > 0 {
            return Front::Garbage(None);
        }
        let fault = if M::format(header.id).is_some() { Fault::BadChecksum } else { Fault::Unknown };
        match held.get(length) {
            None => Front::Incomplete,
            Some(&START) => Front::Opaque { length, fault },
            Some(_) => Front::Garbage(Some(fault)),
        }
    }

    /// What is held begins within sealed bytes with what may be a frame that reaches beyond them, and is not all there.
    /// If the frame behind these bytes is, as of the last byte, and intact, then there is none before it.
    fn behind_sealed(&self, held: &[u8]) -> Front<M> {
        let behind = held.get(self.sealed..).filter(|_| self.sealed > 0).unwrap_or_default();
        let header = behind.first_chunk().map(Header::read).filter(|header| header.frame_length() == behind.len());
        let read = header.and_then(|header| Some((header, self.read(behind, &header)?)));
        read.map_or(Front::Incomplete, |(header, message)| Front::Intact { skipped: self.sealed, header, message })
    }

    /// The message in `frame`, if the frame's checksum is known and right.
    fn read(&self, frame: &[u8], header: &Header) -> Option<Result<M, Fault>> {
        let end = HEADER + usize::from(header.length);
        let (summed, payload) = (frame.get(1..end)?, frame.get(HEADER..end)?);
        let sent = frame.get(end..)?.first_chunk().copied().map(u16::from_le_bytes)?;
        let format = M::format(header.id);
        let extra_crc = format.map(|format| format.extra_crc).or_else(|| dialect_extra_crc(header.id))?;
        (checksum(summed, extra_crc) == sent).then(|| match format {
            None => Err(Fault::Unknown),
            Some(_) if header.incompatible != 0 => Err(Fault::Unsupported),
            Some(format) if payload.len() > format.length_max => Err(Fault::Oversized),
            Some(_) => M::read(header.id, payload, self.receiver),
        })
    }

    /// Skips the first byte, and then all up to one that may start a frame.
    fn skip_to_start(&mut self) {
        let held = self.buffer.get(..self.length).unwrap_or_default();
        let skipped = 1 + held.iter().skip(1).take_while(|&&byte| byte != START).count();
        add(&mut self.counters.skipped_bytes, skipped as u32);
        self.remove(skipped);
    }

    /// Drops the first `count` bytes of those held.
    fn remove(&mut self, count: usize) {
        if let Some(held) = self.buffer.get_mut(..self.length) {
            let count = count.min(held.len());
            held.copy_within(count.., 0);
            self.length -= count;
            self.sealed = self.sealed.saturating_sub(count);
        }
    }

    /// Counts the gap before a frame. What comes out of order or twice is no gap.
    fn count_lost(&mut self, header: &Header) {
        let gap = match self.last {
            Some((from, sequence)) if from == header.from => header.sequence.wrapping_sub(sequence).wrapping_sub(1),
            _ => 0,
        };
        if gap < 128 {
            add(&mut self.counters.lost, u32::from(gap));
            self.last = Some((header.from, header.sequence));
        }
    }
}

/// The seed of the checksum of any message of the `common` dialect.
fn dialect_extra_crc(id: u32) -> Option<u8> {
    /// The one message whose seed is 0, which stands for "not in the dialect", too.
    const COMPONENT_INFORMATION: u32 = 395;
    match MavMessage::extra_crc(id) {
        0 if id != COMPONENT_INFORMATION => None,
        extra_crc => Some(extra_crc),
    }
}

//! From a stream of bytes to messages.

use crate::framing::{Address, CHECKSUM, FRAME_MAX, HEADER, Header, START, checksum};
use crate::message::{Fault, Message};
use core::marker::PhantomData;

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
    /// Bytes that belonged to no frame that arrived intact.
    pub skipped_bytes: u32,
    /// Frames that never arrived or that the direction does not carry, by the gaps between one sender's sequence
    /// numbers.
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
/// A frame is taken for one when its header names a message that the direction carries, with a length that it may have,
/// and its checksum is right. Whatever else begins like a frame is given up at the first byte that rules it out, its
/// first byte is skipped, and the search goes on in the bytes that came after: a frame behind garbage is never lost. It
/// may be late, if the garbage ends like the beginning of a longer frame: by as many bytes as that one announces, at
/// most [`FRAME_MAX`].
///
/// A byte costs at most one look at every byte held, and a checksum over those behind each one that looks like a
/// header; in a stream of intact frames, a copy and, at the end of a frame, its checksum.
pub struct Decoder<M> {
    receiver: Address,
    buffer: [u8; FRAME_MAX],
    length: usize,
    /// Sender and sequence number of the last frame.
    last: Option<(Address, u8)>,
    counters: Counters,
    messages: PhantomData<fn() -> M>,
}

/// What the bytes held begin with.
enum Front<M> {
    /// Nothing yet, or too little to tell.
    Incomplete,
    /// No frame.
    Garbage(Option<Fault>),
    /// An intact frame of `length` bytes.
    Frame { length: usize, header: Header, message: Result<M, Fault> },
}

impl<M: Message> Decoder<M> {
    /// Reads in the name of `receiver`.
    pub fn new(receiver: Address) -> Self {
        Decoder {
            receiver,
            buffer: [0; FRAME_MAX],
            length: 0,
            last: None,
            counters: Counters::default(),
            messages: PhantomData,
        }
    }

    /// Takes the next bytes of the stream and hands over every message that they complete, with its sender.
    pub fn feed(&mut self, bytes: &[u8], mut deliver: impl FnMut(Address, M)) {
        for &byte in bytes {
            // There is room: no frame is longer than the buffer, so a full one was emptied by `advance`.
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
                    if let Some(fault) = fault {
                        self.counters.count(fault);
                    }
                    self.skip_to_start();
                }
                Front::Frame { length, header, message } => {
                    self.remove(length);
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
        let Some(format) = M::format(header.id) else { return Front::Garbage(Some(Fault::Unknown)) };
        if header.incompatible != 0 {
            return Front::Garbage(Some(Fault::Unsupported));
        }
        if usize::from(header.length) > format.length_max {
            return Front::Garbage(Some(Fault::Oversized));
        }
        let end = HEADER + usize::from(header.length);
        let (Some(summed), Some(payload), Some(&[low, high])) =
            (held.get(1..end), held.get(HEADER..end), held.get(end..end + CHECKSUM))
        else {
            return Front::Incomplete;
        };
        if checksum(summed, format.extra_crc) != u16::from_le_bytes([low, high]) {
            return Front::Garbage(Some(Fault::BadChecksum));
        }
        Front::Frame { length: end + CHECKSUM, header, message: M::read(header.id, payload, self.receiver) }
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

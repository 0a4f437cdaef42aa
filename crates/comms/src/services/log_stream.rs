//! Streams the flight log while it is written: MAV_CMD_LOGGING_START, LOGGING_DATA_ACKED, LOGGING_ACK, LOGGING_DATA.
//!
//! The protocol is PX4's. The definitions at the beginning of the log are sent in parts, each of which must be
//! acknowledged before the next is sent. So the log can be read even if later parts are lost. All parts after the
//! definitions are sent once. Each part names its first whole record, so that a reader can continue after a loss.

use super::storage::LogSource;
use afbc_mavlink::{Address, STREAM_DATA_MAX, StreamedLog};

/// A part without an acknowledgement is sent again after this time \[us\], and this many times in all.
const REPEAT_US: u64 = 200_000;
const TRIES: u8 = 25;
/// Length of the ULog file header \[bytes\].
const HEADER: u32 = 16;
/// Length of a record's header \[bytes\]: length and type.
const HEAD: usize = 3;
/// Types of records that belong to the definitions.
const DEFINITIONS: &[u8] = b"BFIMPQA";

/// Log stream to one station.
#[derive(Clone, Debug, Default)]
pub struct LogStream {
    /// The stream, if one is active.
    stream: Option<Stream>,
}

/// Result of a step of the stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(clippy::large_enum_variant, reason = "one at a time")]
pub enum StreamEvent {
    /// This part is to be sent.
    Part(StreamedLog),
    /// The station has not acknowledged a part, and the stream has ended.
    Unheard,
}

#[derive(Clone, Debug)]
struct Stream {
    to: Address,
    /// Sequence number of the next part.
    sequence: u16,
    /// True until the first data record.
    defines: bool,
    records: Records,
    /// Part that is being filled.
    part: LogStreamPart,
    /// Part to be acknowledged, the time at which it was last sent, and the number of times it was sent.
    waiting: Option<(StreamedLog, u64, u8)>,
}

#[derive(Clone, Debug)]
struct LogStreamPart {
    bytes: [u8; STREAM_DATA_MAX],
    length: usize,
    /// Offset of the first record that begins in the part.
    first_record: Option<usize>,
}

impl LogStreamPart {
    const EMPTY: LogStreamPart = LogStreamPart { bytes: [0; STREAM_DATA_MAX], length: 0, first_record: None };

    fn push(&mut self, byte: u8) {
        if let Some(to) = self.bytes.get_mut(self.length) {
            *to = byte;
            self.length += 1;
        }
    }

    fn room(&self) -> usize {
        STREAM_DATA_MAX - self.length
    }
}

/// Finds the beginnings of records.
#[derive(Clone, Debug)]
struct Records {
    /// Number of bytes until the next record.
    left: u32,
    /// Header bytes of the next record, and the number of them received.
    head: [u8; HEAD],
    known: usize,
}

impl Records {
    const BEGIN: Records = Records { left: HEADER, head: [0; HEAD], known: 0 };

    fn is_at_start(&self) -> bool {
        self.left == 0 && self.known == 0
    }

    /// Takes the next byte. If the byte completes a record's header, returns the type of the record.
    fn take(&mut self, byte: u8) -> Option<u8> {
        if self.left > 0 {
            self.left -= 1;
            return None;
        }
        if let Some(to) = self.head.get_mut(self.known) {
            *to = byte;
        }
        self.known += 1;
        if self.known < HEAD {
            return None;
        }
        let [low, high, kind] = self.head;
        (self.left, self.known) = (u16::from_le_bytes([low, high]).into(), 0);
        Some(kind)
    }
}

impl LogStream {
    /// Begins a log for a station, and ends any log in progress. Returns false if the source has no log.
    pub fn start(&mut self, to: Address, source: &mut impl LogSource) -> bool {
        self.stop(source);
        let starts = source.start_log();
        self.stream = starts.then_some(Stream {
            to,
            sequence: 0,
            defines: true,
            records: Records::BEGIN,
            part: LogStreamPart::EMPTY,
            waiting: None,
        });
        starts
    }

    /// Ends the log.
    pub fn stop(&mut self, source: &mut impl LogSource) {
        if self.stream.take().is_some() {
            source.stop_log();
        }
    }

    /// Returns true while a stream is active.
    pub fn is_active(&self) -> bool {
        self.stream.is_some()
    }

    /// Notes that a station has acknowledged a part.
    pub fn acknowledge(&mut self, from: Address, sequence: u16) {
        if let Some(stream) = &mut self.stream
            && stream.to == from
            && stream.waiting.is_some_and(|(part, ..)| part.sequence == sequence)
        {
            stream.waiting = None;
        }
    }

    /// Returns the next event, if any.
    pub fn next(&mut self, source: &mut impl LogSource, now_us: u64) -> Option<StreamEvent> {
        let stream = self.stream.as_mut()?;
        if let Some((part, sent_us, tries)) = &mut stream.waiting {
            if now_us.saturating_sub(*sent_us) < REPEAT_US {
                return None;
            }
            if *tries >= TRIES {
                self.stop(source);
                return Some(StreamEvent::Unheard);
            }
            (*sent_us, *tries) = (now_us, *tries + 1);
            return Some(StreamEvent::Part(*part));
        }
        let part = stream.fill(source)?;
        if part.to_be_acknowledged {
            stream.waiting = Some((part, now_us, 1));
        }
        Some(StreamEvent::Part(part))
    }
}

impl Stream {
    /// Takes bytes from the source until a part is complete. Returns that part.
    fn fill(&mut self, source: &mut impl LogSource) -> Option<StreamedLog> {
        loop {
            let front = source.log_bytes();
            if front.is_empty() {
                return None;
            }
            let mut taken = 0;
            let mut whole = None;
            for byte in front {
                whole = self.push(*byte);
                taken += 1;
                if whole.is_some() {
                    break;
                }
            }
            source.consume_log(taken);
            if whole.is_some() {
                return whole;
            }
        }
    }

    /// Adds a byte. Returns a part that the byte completes, or one that had to end before the byte.
    fn push(&mut self, byte: u8) -> Option<StreamedLog> {
        // The header of a data record must not be in the same part as definitions.
        let is_at_start = self.records.is_at_start();
        let split = is_at_start && self.defines && self.part.room() < HEAD;
        let before = split.then(|| self.cut(0, true));
        if is_at_start {
            self.part.first_record.get_or_insert(self.part.length);
        }
        self.part.push(byte);
        let kind = self.records.take(byte);
        if self.defines && kind.is_some_and(|kind| !DEFINITIONS.contains(&kind)) {
            self.defines = false;
            // A part that has only this header continues as a part with data.
            return (self.part.length > HEAD).then(|| self.cut(HEAD, true));
        }
        before.or_else(|| (self.part.room() == 0).then(|| self.cut(0, self.defines)))
    }

    /// Ends the part `rest` bytes before its end, and begins the next part with these bytes. They must begin with a
    /// record.
    fn cut(&mut self, rest: usize, to_be_acknowledged: bool) -> StreamedLog {
        let LogStreamPart { mut bytes, length, first_record } =
            core::mem::replace(&mut self.part, LogStreamPart::EMPTY);
        let length = length.saturating_sub(rest);
        if rest > 0 {
            self.part.first_record = Some(0);
        }
        for byte in bytes.iter_mut().skip(length) {
            if self.part.length < rest {
                self.part.push(*byte);
            }
            *byte = 0;
        }
        let (to, sequence) = (self.to, self.sequence);
        self.sequence = self.sequence.wrapping_add(1);
        // Length and first record are below 256.
        let first_record = first_record.filter(|at| *at < length).map(|at| at as u8);
        StreamedLog { to, sequence, length: length as u8, first_record, data: bytes, to_be_acknowledged }
    }
}

//! The black box's log while it is made: MAV_CMD_LOGGING_START, LOGGING_DATA_ACKED, LOGGING_ACK, LOGGING_DATA.
//!
//! As PX4 does it: the definitions at the log's beginning come in parts each of which must be acknowledged before the
//! next is sent, so that the log can be read whatever of the rest is lost. From its first message of data on, parts
//! are sent once; each names its first whole record, so that a reader finds its way after a loss.

use super::storage::LogSource;
use afbc_link::{Address, STREAM_DATA_MAX, StreamedLog};

/// Time after which a part that is not acknowledged is sent again, and how often it is sent \[us\].
const REPEAT_US: u64 = 200_000;
const TRIES: u8 = 25;
/// Length of a log's header \[bytes\].
const HEADER: u32 = 16;
/// Bytes of a record before its content: length, kind.
const HEAD: usize = 3;
/// Kinds of records that belong to the definitions.
const DEFINITIONS: &[u8] = b"BFIMPQA";

/// The log that one station gets.
#[derive(Clone, Debug, Default)]
pub struct LogStream {
    /// None if there is none.
    stream: Option<Stream>,
}

/// What has become of a stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(clippy::large_enum_variant, reason = "one at a time")]
pub enum StreamEvent {
    /// A part is to be sent.
    Part(StreamedLog),
    /// The station does not acknowledge, and the stream has ended.
    Unheard,
}

#[derive(Clone, Debug)]
struct Stream {
    to: Address,
    /// Number of the next part.
    sequence: u16,
    /// True until the first record of data.
    defines: bool,
    records: Records,
    /// The part that is being filled.
    part: Part,
    /// The part that is to be acknowledged, when it was sent last, and how often.
    waiting: Option<(StreamedLog, u64, u8)>,
}

#[derive(Clone, Debug)]
struct Part {
    bytes: [u8; STREAM_DATA_MAX],
    length: usize,
    /// Where its first record begins.
    first_record: Option<usize>,
}

impl Part {
    const EMPTY: Part = Part { bytes: [0; STREAM_DATA_MAX], length: 0, first_record: None };

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

/// Where records begin.
#[derive(Clone, Debug)]
struct Records {
    /// Bytes until the next one.
    left: u32,
    /// Its head, as far as it is known.
    head: [u8; HEAD],
    known: usize,
}

impl Records {
    const BEGIN: Records = Records { left: HEADER, head: [0; HEAD], known: 0 };

    fn is_at_start(&self) -> bool {
        self.left == 0 && self.known == 0
    }

    /// Takes the next byte; returns the kind of a record whose head ends with it.
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
    /// Begins a log for a station; false if the source has none. One that is under way ends.
    pub fn start(&mut self, to: Address, source: &mut impl LogSource) -> bool {
        self.stop(source);
        let starts = source.start_log();
        self.stream = starts.then_some(Stream {
            to,
            sequence: 0,
            defines: true,
            records: Records::BEGIN,
            part: Part::EMPTY,
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

    /// True if there is one.
    pub fn is_active(&self) -> bool {
        self.stream.is_some()
    }

    /// Notes that a station has the part with this number.
    pub fn acknowledge(&mut self, from: Address, sequence: u16) {
        if let Some(stream) = &mut self.stream
            && stream.to == from
            && stream.waiting.is_some_and(|(part, ..)| part.sequence == sequence)
        {
            stream.waiting = None;
        }
    }

    /// Returns what is next, if anything is.
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
    /// Takes bytes of the source until a part is whole, and returns that.
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

    /// Adds a byte; returns the part that is whole with it, or before it.
    fn push(&mut self, byte: u8) -> Option<StreamedLog> {
        // The head of a record of data must not be in a part with definitions.
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
            // Unless the part begins with it.
            return (self.part.length > HEAD).then(|| self.cut(HEAD, true));
        }
        before.or_else(|| (self.part.room() == 0).then(|| self.cut(0, self.defines)))
    }

    /// Ends the part so many bytes before its end, where a record begins if there are any, and begins the next one with
    /// them.
    fn cut(&mut self, rest: usize, to_be_acknowledged: bool) -> StreamedLog {
        let Part { mut bytes, length, first_record } = core::mem::replace(&mut self.part, Part::EMPTY);
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
        // Both fit into a byte.
        let first_record = first_record.filter(|at| *at < length).map(|at| at as u8);
        StreamedLog { to, sequence, length: length as u8, first_record, data: bytes, to_be_acknowledged }
    }
}

//! A station that lists the logs of a memory card, downloads both ends of the first one, and has all of them erased.

use crate::check::check;
use afbc_link::{Decoder, LogEntry, LogMessage, LogRequest, Question, Uplink};
use std::error::Error;

/// Time from the end of the flight until the log has ended, and between two tries of a request [ms].
const WAIT_MS: u64 = 3_000;
const AGAIN_MS: u64 = 1_000;
/// Time within which all must be done [ms].
pub const PATIENCE_MS: u64 = 60_000;
/// Bytes of each end.
const END: u32 = 20_000;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Step {
    Lists,
    Begins,
    Ends,
    /// All is here that is to be compared with the card.
    Erases,
    ListsAgain,
    Done,
}

/// The station.
pub struct Fetch {
    decoder: Decoder<LogMessage>,
    step: Step,
    /// When it began, and when it has asked last [ms].
    since_ms: u64,
    asked_ms: u64,
    entries: Vec<LogEntry>,
    /// The beginning, and the end.
    parts: [Vec<u8>; 2],
    /// For how long each has come [ms].
    took_ms: [u64; 2],
}

impl Fetch {
    pub fn new(decoder: Decoder<LogMessage>) -> Self {
        Fetch {
            decoder,
            step: Step::Lists,
            since_ms: 0,
            asked_ms: 0,
            entries: Vec::new(),
            parts: [const { Vec::new() }; 2],
            took_ms: [0; 2],
        }
    }

    /// True once all is downloaded that will be, and before it is erased.
    pub fn has_all(&self) -> bool {
        self.step == Step::Erases && self.asked_ms == 0
    }

    pub fn is_done(&self) -> bool {
        self.step == Step::Done
    }

    fn size(&self) -> u32 {
        self.entries.first().map_or(0, |entry| entry.size)
    }

    /// Returns offset and length of a part of the first log.
    fn span(&self, part: usize) -> [u32; 2] {
        let length = END.min(self.size());
        [if part == 0 { 0 } else { self.size() - length }, length]
    }

    fn go_to(&mut self, step: Step, now_ms: u64) {
        (self.step, self.since_ms, self.asked_ms) = (step, now_ms, 0);
    }

    /// Hears the vehicle.
    pub fn hear(&mut self, bytes: &[u8], now_ms: u64) {
        let mut messages = Vec::new();
        self.decoder.feed(bytes, |_, message| messages.push(message));
        for message in messages {
            match (self.step, message) {
                (Step::Lists, LogMessage::Entry(entry)) => {
                    if usize::from(entry.log) == self.entries.len() && entry.count > 0 {
                        self.entries.push(entry);
                    }
                    if self.entries.len() == usize::from(entry.count) {
                        self.go_to(Step::Begins, now_ms);
                    }
                }
                (Step::Begins | Step::Ends, LogMessage::Data(data)) => {
                    let part = usize::from(self.step == Step::Ends);
                    let [offset, length] = self.span(part);
                    let held = &mut self.parts[part];
                    // In order; the rest is asked for again.
                    if data.offset == offset + held.len() as u32 {
                        held.extend_from_slice(&data.data[..data.count.into()]);
                    }
                    if held.len() as u32 >= length {
                        self.took_ms[part] = now_ms - self.since_ms;
                        // What is on the card is looked at before it is erased.
                        self.go_to(if part == 0 { Step::Ends } else { Step::Erases }, now_ms + 10 * part as u64);
                    }
                }
                (Step::ListsAgain, LogMessage::Entry(entry)) => {
                    self.entries.retain(|_| entry.count > 0);
                    if self.entries.is_empty() {
                        self.go_to(Step::Done, now_ms);
                    }
                }
                _ => {}
            }
        }
    }

    /// Returns what is asked for in this millisecond.
    pub fn next(&mut self, now_ms: u64) -> Option<Uplink> {
        if self.since_ms == 0 {
            self.since_ms = now_ms + WAIT_MS;
        }
        let is_time = self.asked_ms == 0 || now_ms >= self.asked_ms + AGAIN_MS;
        if now_ms < self.since_ms || !is_time {
            return None;
        }
        self.asked_ms = now_ms;
        let request = match self.step {
            Step::Lists | Step::ListsAgain => LogRequest::List { first: 0, last: u16::MAX },
            Step::Begins | Step::Ends => {
                let part = usize::from(self.step == Step::Ends);
                let ([offset, length], held) = (self.span(part), self.parts[part].len() as u32);
                LogRequest::Data { log: 0, offset: offset + held, bytes: length - held }
            }
            Step::Erases => {
                // Nothing answers but the list.
                self.go_to(Step::ListsAgain, now_ms);
                (self.since_ms, self.asked_ms) = (now_ms + AGAIN_MS, 1);
                LogRequest::Erase
            }
            Step::Done => return None,
        };
        Some(Uplink::Question(Question::Log(request)))
    }

    /// Compares with the logs on the card, by place.
    pub fn compare(&self, logs: &[Vec<u8>]) -> Result<(), Box<dyn Error>> {
        let sizes: Vec<_> = self.entries.iter().map(|entry| entry.size as usize).collect();
        println!("listed {sizes:?} bytes; {END} bytes each in {:?} ms", self.took_ms);
        check(sizes == logs.iter().map(Vec::len).collect::<Vec<_>>(), "the list is that of the card")?;
        let first = logs.first().ok_or("there is a log")?;
        for (part, held) in self.parts.iter().enumerate() {
            let [offset, length] = self.span(part).map(|number| number as usize);
            check(first[offset..offset + length] == held[..], "what is downloaded is what is on the card")?;
        }
        Ok(())
    }
}

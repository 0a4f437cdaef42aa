//! Ground station that lists the logs of a memory card, downloads beginning and end of the first log, and erases all
//! logs.

use crate::check::check;
use afbc_mavlink::{Decoder, LogEntry, LogMessage, LogRequest, ServiceRequest, Uplink};
use std::error::Error;

/// Time after the flight until the log has ended, and between two attempts of a request [ms].
const WAIT_MS: u64 = 3_000;
const AGAIN_MS: u64 = 1_000;
/// Time within which all of this must be done [ms].
pub const PATIENCE_MS: u64 = 60_000;
/// Bytes downloaded of the log's beginning, and of its end.
const END: u32 = 20_000;

#[derive(Clone, Copy, Debug, PartialEq)]
enum FetchStep {
    Lists,
    Begins,
    Ends,
    /// The downloads are complete, and are to be compared with the card before it is erased.
    Erases,
    ListsAgain,
    Done,
}

/// Ground station's state.
pub struct Fetch {
    decoder: Decoder<LogMessage>,
    step: FetchStep,
    /// Start of the step, and time of the last request [ms].
    since_ms: u64,
    asked_ms: u64,
    entries: Vec<LogEntry>,
    /// Downloaded beginning and end of the log.
    parts: [Vec<u8>; 2],
    /// Duration of each download [ms].
    took_ms: [u64; 2],
}

impl Fetch {
    pub fn new(decoder: Decoder<LogMessage>) -> Self {
        Fetch {
            decoder,
            step: FetchStep::Lists,
            since_ms: 0,
            asked_ms: 0,
            entries: Vec::new(),
            parts: [const { Vec::new() }; 2],
            took_ms: [0; 2],
        }
    }

    /// True when all downloads are complete and nothing has been erased yet.
    pub fn has_all(&self) -> bool {
        self.step == FetchStep::Erases && self.asked_ms == 0
    }

    pub fn is_done(&self) -> bool {
        self.step == FetchStep::Done
    }

    fn size(&self) -> u32 {
        self.entries.first().map_or(0, |entry| entry.size)
    }

    /// Returns offset and length of a part of the first log.
    fn span(&self, part: usize) -> [u32; 2] {
        let length = END.min(self.size());
        [if part == 0 { 0 } else { self.size() - length }, length]
    }

    fn go_to(&mut self, step: FetchStep, now_ms: u64) {
        (self.step, self.since_ms, self.asked_ms) = (step, now_ms, 0);
    }

    /// Processes messages from the vehicle.
    pub fn hear(&mut self, bytes: &[u8], now_ms: u64) {
        let mut messages = Vec::new();
        self.decoder.feed(bytes, |_, message| messages.push(message));
        for message in messages {
            match (self.step, message) {
                (FetchStep::Lists, LogMessage::Entry(entry)) => {
                    if usize::from(entry.log) == self.entries.len() && entry.count > 0 {
                        self.entries.push(entry);
                    }
                    if self.entries.len() == usize::from(entry.count) {
                        self.go_to(FetchStep::Begins, now_ms);
                    }
                }
                (FetchStep::Begins | FetchStep::Ends, LogMessage::Data(data)) => {
                    let part = usize::from(self.step == FetchStep::Ends);
                    let [offset, length] = self.span(part);
                    let held = &mut self.parts[part];
                    // Only data in order are kept; missing data are requested again.
                    if data.offset == offset + held.len() as u32 {
                        held.extend_from_slice(&data.data[..data.count.into()]);
                    }
                    if held.len() as u32 >= length {
                        self.took_ms[part] = now_ms - self.since_ms;
                        // Wait before the erase, so that the card can be compared first.
                        self.go_to(
                            if part == 0 { FetchStep::Ends } else { FetchStep::Erases },
                            now_ms + 10 * part as u64,
                        );
                    }
                }
                (FetchStep::ListsAgain, LogMessage::Entry(entry)) => {
                    self.entries.retain(|_| entry.count > 0);
                    if self.entries.is_empty() {
                        self.go_to(FetchStep::Done, now_ms);
                    }
                }
                _ => {}
            }
        }
    }

    /// Returns the request to send in this millisecond, if any.
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
            FetchStep::Lists | FetchStep::ListsAgain => LogRequest::List { first: 0, last: u16::MAX },
            FetchStep::Begins | FetchStep::Ends => {
                let part = usize::from(self.step == FetchStep::Ends);
                let ([offset, length], held) = (self.span(part), self.parts[part].len() as u32);
                LogRequest::Data { log: 0, offset: offset + held, bytes: length - held }
            }
            FetchStep::Erases => {
                // An erase has no answer; only a new list shows its success.
                self.go_to(FetchStep::ListsAgain, now_ms);
                (self.since_ms, self.asked_ms) = (now_ms + AGAIN_MS, 1);
                LogRequest::Erase
            }
            FetchStep::Done => return None,
        };
        Some(Uplink::ServiceRequest(ServiceRequest::Log(request)))
    }

    /// Compares the list and the downloads with the logs on the card.
    pub fn compare(&self, logs: &[Vec<u8>]) -> Result<(), Box<dyn Error>> {
        let sizes: Vec<_> = self.entries.iter().map(|entry| entry.size as usize).collect();
        println!("logs listed with {sizes:?} bytes; parts of {END} bytes downloaded in {:?} ms", self.took_ms);
        check(sizes == logs.iter().map(Vec::len).collect::<Vec<_>>(), "the list equals the card's files")?;
        let first = logs.first().ok_or("there is no log on the card")?;
        for (part, held) in self.parts.iter().enumerate() {
            let [offset, length] = self.span(part).map(|number| number as usize);
            check(first[offset..offset + length] == held[..], "the download equals the file on the card")?;
        }
        Ok(())
    }
}

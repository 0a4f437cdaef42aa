//! This side of the link.

use crate::error::Error;
use crate::heard::Heard;
use afbc_hil::Autopilot;
use afbc_link::{
    Address, Answer, Command, Counters, Decoder, Downlink, FRAME_MAX, InertialSample, ParameterRequest, ReceivedFrame,
    Sender, Uplink,
};

/// Usual address of a ground station.
const ADDRESS: Address = Address { system: 255, component: 190 };
/// Time between two heartbeats \[ms\].
const BEAT_MS: u64 = 1_000;
/// Time in which a question is answered, and how often it is asked \[ms\].
const ANSWER_MS: u64 = 1_000;
const ASKED_MAX: usize = 3;

/// A conversation with a vehicle.
pub(crate) struct Conversation<'a> {
    port: &'a mut dyn Autopilot,
    sender: Sender,
    decoder: Decoder<Downlink>,
    /// The same bytes: what sensors read is a message by itself.
    samples: Decoder<InertialSample>,
    outgoing: Vec<u8>,
    now_ms: u64,
    bytes: u64,
    pub(crate) heard: Heard,
}

impl<'a> Conversation<'a> {
    pub(crate) fn new(port: &'a mut dyn Autopilot) -> Self {
        Conversation {
            port,
            sender: Sender::new(ADDRESS),
            decoder: Decoder::new(ADDRESS),
            samples: Decoder::new(ADDRESS),
            outgoing: Vec::new(),
            now_ms: 0,
            bytes: 0,
            heard: Heard::default(),
        }
    }

    /// Time since it began \[ms\].
    pub(crate) fn now_ms(&self) -> u64 {
        self.now_ms
    }

    /// Number of bytes that have come.
    pub(crate) fn bytes(&self) -> u64 {
        self.bytes
    }

    pub(crate) fn counters(&self) -> &Counters {
        self.decoder.counters()
    }

    pub(crate) fn say(&mut self, message: &Uplink) {
        self.outgoing.extend_from_slice(self.sender.send(message, &mut [0; FRAME_MAX]));
    }

    /// Lets a millisecond go by.
    fn exchange(&mut self) -> Result<(), Error> {
        if self.now_ms.is_multiple_of(BEAT_MS) {
            self.say(&Uplink::Heartbeat);
        }
        let Conversation { port, decoder, samples, outgoing, now_ms, bytes, heard, .. } = self;
        let mut signed = false;
        port.exchange(outgoing, &mut |piece| {
            *bytes += piece.len() as u64;
            let accept = |frame: &ReceivedFrame<'_>| {
                signed |= frame.stamp().is_some();
                true
            };
            decoder.feed_accepted(piece, accept, |from, message| heard.take(from, message, *now_ms));
            samples.feed(piece, |from, sample| {
                if heard.vehicle.is_some_and(|(vehicle, _)| vehicle == from) {
                    heard.samples.push(sample);
                }
            });
        })?;
        outgoing.clear();
        self.now_ms += 1;
        if signed { Err(Error::Signed) } else { Ok(()) }
    }

    /// Lets this time go by.
    pub(crate) fn listen(&mut self, milliseconds: u64) -> Result<(), Error> {
        (0..milliseconds).try_for_each(|_| self.exchange())
    }

    /// Waits until this is so, for so long at most; returns whether it is.
    pub(crate) fn wait(&mut self, patience_ms: u64, mut done: impl FnMut(&mut Heard) -> bool) -> Result<bool, Error> {
        for _ in 0..patience_ms {
            if done(&mut self.heard) {
                return Ok(true);
            }
            self.exchange()?;
        }
        Ok(done(&mut self.heard))
    }

    /// Sends a command of this number; returns the answer, and after how long it came \[ms\].
    pub(crate) fn command(&mut self, command: Command, number: u16) -> Result<Option<(Answer, u64)>, Error> {
        for _ in 0..ASKED_MAX {
            // An answer to an earlier question is none to this one.
            self.heard.answers.remove(&number);
            self.say(&Uplink::Command(command));
            let began_ms = self.now_ms;
            self.wait(ANSWER_MS, |heard| heard.answers.contains_key(&number))?;
            if let Some(answer) = self.heard.answers.get(&number) {
                return Ok(Some((*answer, self.now_ms - began_ms)));
            }
        }
        Ok(None)
    }

    /// Asks for all parameters, and again for those that do not come.
    pub(crate) fn parameters(&mut self) -> Result<(), Error> {
        /// Time without a further parameter after which the rest is asked for \[ms\].
        const STALLED_MS: u64 = 1_000;
        /// Most that are asked for at once.
        const MISSING_MAX: usize = 10;
        let mut known = 0;
        self.say(&Uplink::Parameter(ParameterRequest::List));
        for _ in 0..20 {
            while self.wait(STALLED_MS, |heard| heard.parameters.len() > known)? && !self.heard.has_all_parameters() {
                known = self.heard.parameters.len();
            }
            if self.heard.has_all_parameters() {
                break;
            }
            // Nothing has come: the request itself was lost.
            let Some(count) = self.heard.parameter_count else {
                self.say(&Uplink::Parameter(ParameterRequest::List));
                continue;
            };
            let missing = (0..count).filter(|place| !self.heard.parameters.contains_key(place)).take(MISSING_MAX);
            for place in missing.collect::<Vec<_>>() {
                self.say(&Uplink::Parameter(ParameterRequest::ReadPlace(place)));
            }
        }
        Ok(())
    }
}

//! A conversation with a vehicle, a millisecond at a time.

use super::error::{Error, ExchangeError};
use super::heard::Heard;
use crate::client::Client;
use crate::commands::CommandState;
use crate::repeated::Patience;
use afbc_link::{Answer, Command, Decoder, InertialSample, ReceivedFrame};

/// What carries bytes to the board and back.
///
/// It sends the bytes that it is given, runs a millisecond, and passes those that have come to the other function, in
/// pieces of any size.
pub type Exchange<'a> = dyn FnMut(&[u8], &mut dyn FnMut(&[u8])) -> Result<(), ExchangeError> + 'a;

/// Time between two heartbeats \[ms\].
const BEAT_MS: u64 = 1_000;

/// A conversation with a vehicle.
pub(crate) struct Conversation<'a> {
    exchange: &'a mut Exchange<'a>,
    pub(crate) client: Client,
    /// The same bytes: what sensors read is a message by itself.
    samples: Decoder<InertialSample>,
    now_ms: u64,
    bytes: u64,
    pub(crate) heard: Heard,
}

impl<'a> Conversation<'a> {
    pub(crate) fn new(exchange: &'a mut Exchange<'a>) -> Self {
        let mut client = Client::new(Client::STATION);
        client.beat_every(Some(BEAT_MS));
        let samples = Decoder::new(Client::STATION);
        Conversation { exchange, client, samples, now_ms: 0, bytes: 0, heard: Heard::default() }
    }

    /// Time since it began \[ms\].
    pub(crate) fn now_ms(&self) -> u64 {
        self.now_ms
    }

    /// Number of bytes that have come.
    pub(crate) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Lets a millisecond go by.
    fn exchange(&mut self) -> Result<(), Error> {
        let Conversation { exchange, client, samples, now_ms, bytes, heard } = self;
        client.turn(*now_ms);
        let (uplink, mut signed) = (client.take(), false);
        exchange(&uplink, &mut |piece| {
            *bytes += piece.len() as u64;
            let accept = |frame: &ReceivedFrame<'_>| {
                signed |= frame.stamp().is_some();
                true
            };
            client.hear_accepted(piece, accept, |_, message| heard.take(message));
            samples.feed(piece, |from, sample| {
                if client.vehicle().address == Some(from) {
                    heard.samples.push(sample);
                }
            });
        })
        .map_err(Error::Connection)?;
        *now_ms += 1;
        if signed { Err(Error::Signed) } else { Ok(()) }
    }

    /// Lets this time go by.
    pub(crate) fn listen(&mut self, milliseconds: u64) -> Result<(), Error> {
        (0..milliseconds).try_for_each(|_| self.exchange())
    }

    /// Waits until this is so, for so long at most; returns whether it is.
    pub(crate) fn wait(&mut self, patience_ms: u64, mut done: impl FnMut(&mut Self) -> bool) -> Result<bool, Error> {
        for _ in 0..patience_ms {
            if done(self) {
                return Ok(true);
            }
            self.exchange()?;
        }
        Ok(done(self))
    }

    /// Gives a command; returns the answer, and after how long it came \[ms\].
    pub(crate) fn command(&mut self, command: Command) -> Result<Option<(Answer, u64)>, Error> {
        self.client.command(command, Patience::REPEATED);
        loop {
            match self.client.state(command) {
                Some(CommandState::Waiting) => self.exchange()?,
                // What comes within a millisecond is there at its end.
                Some(CommandState::Answered { answer, after_ms }) => return Ok(Some((answer, after_ms + 1))),
                Some(CommandState::Silent) | None => return Ok(None),
            }
        }
    }

    /// Reads all parameters, as far as they come.
    pub(crate) fn read_parameters(&mut self) -> Result<(), Error> {
        self.client.read_parameters();
        while self.client.parameters().are_being_read() {
            self.exchange()?;
        }
        Ok(())
    }

    /// Texts that have come after the first so many.
    pub(crate) fn texts_after(&self, told: usize) -> impl Iterator<Item = &str> {
        self.client.vehicle().texts.iter().skip(told).map(|text| text.text.as_str())
    }
}

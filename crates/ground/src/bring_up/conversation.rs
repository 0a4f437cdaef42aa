//! A conversation with a vehicle in steps of one millisecond.

use super::error::{Error, ExchangeError};
use super::latest::LatestMessages;
use crate::client::Client;
use crate::commands::CommandState;
use crate::retry::RetryPolicy;
use afbc_mavlink::{CommandResult, Decoder, InertialSample, ReceivedFrame, VehicleCommand};

/// Carries bytes to the board and back.
///
/// Sends the given bytes, runs one millisecond, and passes the received bytes to the callback, in pieces of any size.
pub type ByteExchange<'a> = dyn FnMut(&[u8], &mut dyn FnMut(&[u8])) -> Result<(), ExchangeError> + 'a;

/// Heartbeat period \[ms\].
const BEAT_MS: u64 = 1_000;

/// A ground station's conversation with one vehicle.
pub(crate) struct Conversation<'a> {
    exchange: &'a mut ByteExchange<'a>,
    pub(crate) client: Client,
    /// Second decoder of the same bytes, for the inertial samples.
    samples: Decoder<InertialSample>,
    now_ms: u64,
    bytes: u64,
    pub(crate) latest: LatestMessages,
}

impl<'a> Conversation<'a> {
    pub(crate) fn new(exchange: &'a mut ByteExchange<'a>) -> Self {
        let mut client = Client::new(Client::STATION);
        client.set_heartbeat_period(Some(BEAT_MS));
        let samples = Decoder::new(Client::STATION);
        Conversation { exchange, client, samples, now_ms: 0, bytes: 0, latest: LatestMessages::default() }
    }

    /// Returns the time since the conversation began \[ms\].
    pub(crate) fn now_ms(&self) -> u64 {
        self.now_ms
    }

    /// Returns the number of bytes received.
    pub(crate) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Sends the queued frames, runs one millisecond, and handles the received bytes.
    fn exchange(&mut self) -> Result<(), Error> {
        let Conversation { exchange, client, samples, now_ms, bytes, latest } = self;
        client.update(*now_ms);
        let (uplink, mut signed) = (client.take(), false);
        exchange(&uplink, &mut |piece| {
            *bytes += piece.len() as u64;
            let accept = |frame: &ReceivedFrame<'_>| {
                signed |= frame.stamp().is_some();
                true
            };
            client.hear_accepted(piece, accept, |_, message| latest.take(message));
            samples.feed(piece, |from, sample| {
                if client.vehicle().address == Some(from) {
                    latest.samples.push(sample);
                }
            });
        })
        .map_err(Error::Connection)?;
        *now_ms += 1;
        if signed { Err(Error::Signed) } else { Ok(()) }
    }

    /// Receives for this time \[ms\].
    pub(crate) fn listen(&mut self, milliseconds: u64) -> Result<(), Error> {
        (0..milliseconds).try_for_each(|_| self.exchange())
    }

    /// Waits at most `patience_ms` until `done` is true; returns whether it is.
    pub(crate) fn wait(&mut self, patience_ms: u64, mut done: impl FnMut(&mut Self) -> bool) -> Result<bool, Error> {
        for _ in 0..patience_ms {
            if done(self) {
                return Ok(true);
            }
            self.exchange()?;
        }
        Ok(done(self))
    }

    /// Sends a command; returns the answer and the time since the last try \[ms\], or `None` without an answer.
    pub(crate) fn command(&mut self, command: VehicleCommand) -> Result<Option<(CommandResult, u64)>, Error> {
        self.client.command(command, RetryPolicy::REPEATED);
        loop {
            match self.client.state(command) {
                Some(CommandState::Waiting) => self.exchange()?,
                // The answer came during the last millisecond, so this millisecond counts too.
                Some(CommandState::Answered { answer, after_ms }) => return Ok(Some((answer, after_ms + 1))),
                Some(CommandState::Silent) | None => return Ok(None),
            }
        }
    }

    /// Reads all parameters; returns when they are complete or the client gives up.
    pub(crate) fn read_parameters(&mut self) -> Result<(), Error> {
        self.client.read_parameters();
        while self.client.parameters().are_being_read() {
            self.exchange()?;
        }
        Ok(())
    }

    /// Returns the texts that came after the first `told` texts.
    pub(crate) fn texts_after(&self, told: usize) -> impl Iterator<Item = &str> {
        self.client.vehicle().texts.iter().skip(told).map(|text| text.text.as_str())
    }
}

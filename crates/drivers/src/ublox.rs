//! u-blox receivers, by their binary protocol (UBX), and any other by NMEA.
//!
//! [`UbxReceiver`] finds the baud rate, asks for the version, and configures the receiver in RAM: navigation solutions
//! (NAV-PVT) ten times a second, five from the eighth generation, no NMEA, the dynamic model of an aircraft with less
//! than 4 g, 115,200 baud unless the line is faster. A solution brings the velocity in all axes, and how good position
//! and velocity are by the receiver's own account: `hAcc`, `vAcc` and `sAcc` are taken as standard deviations along
//! each axis. Sources: u-blox's interface descriptions of M8 (UBX-13003221), M9 (UBX-19035940) and M10 (UBX-21035062).
//!
//! | fault | found by | then |
//! |---|---|---|
//! | the wrong baud rate, no receiver | no whole message in 1.1 s | the next baud rate |
//! | no answer to the poll of the version, but NMEA | three polls | fixes by NMEA, and a poll every 5 s |
//! | a step of the configuration refused or not answered | three times | left out; without NAV-PVT, NMEA |
//! | garbled, lost or foreign bytes | the checksum, a pause of 0.2 s | a frame within the damaged one is found |
//! | silence, a reset | 1 s without a solution, 3 s without NMEA | looked for and configured, first where it was |
//! | no fix, or one that the receiver does not trust | `fixType`, `flags`, `flags3` | an epoch without a fix |
//! | impossible numbers | the receivers' limits; accuracies of 0, or beyond 200 m and 20 m/s | the same |
//!
//! A fix has the time of the first byte of its frame, or of its epoch in NMEA, less [`DELAY_US`].
//!
//! The crate `ublox` was not taken: it panics on frames with a right checksum and numbers that it does not know. The
//! tests compare messages and keys with it.

mod configuration;
mod frame;
mod solution;

use crate::nmea::NmeaDecoder;
use crate::reading::FixReading;
use afbc_types::Stamped;
use configuration::{ACK_ACK, ACK_NAK, FAST_BAUD, Interface, MON_VER, NAV_PVT, Worth, step};
pub use frame::UbxCommand;
use frame::{FrameDecoder, MessageId};

/// Age of a solution when the first byte of its frame arrives \[us\]: 0.12 s, which ArduPilot's flight logs show until
/// a frame is there, less the time of a frame.
pub const DELAY_US: u64 = 110_000;
/// Baud rates of receivers, in the order in which they are tried after those where one was used and found, or at first
/// the usual ones of configured and of new receivers.
pub const BAUDS: [u32; 6] = [9_600, 57_600, 38_400, 115_200, 230_400, 460_800];
const NEW_BAUD: u32 = 38_400;
/// Times that something is asked, and the time for an answer \[us\]. Together they are longer than an epoch of NMEA.
const ASK_MAX: u8 = 3;
const ASK_US: u64 = 370_000;
/// Time for a receiver to change its baud rate \[us\].
const CHANGE_US: u64 = 100_000;
/// Time to another try after a refusal \[us\].
const REFUSED_US: u64 = 50_000;
/// Time between two polls of a receiver that is used by NMEA \[us\].
const POLL_US: u64 = 5_000_000;
/// Time without a solution, and without an epoch of NMEA, after which the receiver is looked for \[us\].
const SOLUTION_SILENT_US: u64 = 1_000_000;
const NMEA_SILENT_US: u64 = 3_000_000;
/// Pause between two epochs of NMEA, at least \[us\].
const EPOCH_PAUSE_US: u64 = 20_000;
/// Bits of a byte on the line.
const BYTE_BITS: u64 = 10;

/// What is to be done with the UART.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ReceiverAction {
    /// Change its baud rate, after what was sent has left.
    Baud(u32),
    /// Send this.
    Send(UbxCommand),
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    /// Tries a baud rate.
    Searches,
    /// Is at this step of the configuration.
    Configures(Interface, u8),
    /// Waits for an answer over the line that this step changed.
    Confirms(Interface, u8),
    /// Is configured.
    Solves,
    /// Takes what comes without being configured.
    Nmea,
}

/// What the receiver has said.
enum Message {
    Version(Interface),
    Answer(MessageId, bool),
    Solution(Option<FixReading>),
    Other,
}

/// A receiver on a UART, without I/O: the UART's bytes go to [`take`](Self::take), and [`poll`](Self::poll) says what
/// to do with it.
pub struct UbxReceiver {
    frames: FrameDecoder,
    nmea: NmeaDecoder,
    phase: Phase,
    /// The UART's baud rate, and whether it is still to be set.
    baud: u32,
    sets_baud: bool,
    /// Baud rates at which the receiver was used, and was found before it was configured.
    used_baud: u32,
    found_baud: u32,
    /// Place of the baud rate in the order of the search.
    place: usize,
    /// How often was asked, whether with a refusal, and when to ask again \[us\].
    asked: u8,
    /// Answers that may still come to the last step, which was asked for more than once.
    owed: u8,
    refused: bool,
    ask_us: u64,
    /// Its baud rate could not be changed.
    keeps_baud: bool,
    /// Newest epoch, newest solution and newest byte \[us\].
    heard_us: u64,
    solved_us: Option<u64>,
    byte_us: u64,
    /// First byte of this epoch of NMEA \[us\].
    epoch_us: u64,
    /// Good sentences before this baud rate was tried.
    sentences: u32,
    searches: u32,
}

impl Default for UbxReceiver {
    fn default() -> Self {
        Self::new()
    }
}

impl UbxReceiver {
    /// One of which nothing is known.
    #[must_use]
    pub fn new() -> Self {
        UbxReceiver {
            frames: FrameDecoder::NEW,
            nmea: NmeaDecoder::new(),
            phase: Phase::Searches,
            baud: FAST_BAUD,
            sets_baud: true,
            used_baud: FAST_BAUD,
            found_baud: NEW_BAUD,
            place: 0,
            asked: 0,
            owed: 0,
            refused: false,
            ask_us: 0,
            keeps_baud: false,
            heard_us: 0,
            solved_us: None,
            byte_us: 0,
            epoch_us: 0,
            sentences: 0,
            searches: 0,
        }
    }

    /// True while it is configured and sends navigation solutions.
    #[must_use]
    pub fn is_configured(&self) -> bool {
        self.phase == Phase::Solves
    }

    /// Number of damaged frames and sentences: a bad line, or the wrong baud rate.
    #[must_use]
    pub fn damaged(&self) -> u32 {
        self.frames.damaged().saturating_add(self.nmea.bad_sentences())
    }

    /// Number of times that it fell silent and was looked for again.
    #[must_use]
    pub fn searches(&self) -> u32 {
        self.searches
    }

    /// Takes a byte that arrived at `at_us`, and returns the fix that it completes with the time at which it was true:
    /// no value for an epoch without a fix.
    pub fn take(&mut self, at_us: u64, byte: u8) -> Option<Stamped<Option<FixReading>>> {
        let byte_us = BYTE_BITS * 1_000_000 / u64::from(self.baud.max(1));
        let mut fix = None;
        self.frames.push(at_us, byte);
        while let Some((first_us, message)) = self.frames.next(byte_us, read) {
            // No byte of it belongs to a sentence.
            self.nmea.begin();
            // Sentences behind a frame begin an epoch, however short the pause between.
            self.byte_us = 0;
            match message {
                Message::Version(interface) => self.identified(interface, at_us),
                Message::Answer(to, accepted) => self.answered(to, accepted, at_us),
                Message::Solution(value) => {
                    (self.heard_us, self.solved_us, self.used_baud) = (at_us, Some(at_us), self.baud);
                    fix = Some(Stamped { value, at_us: first_us.saturating_sub(DELAY_US) });
                }
                Message::Other => (),
            }
        }
        // An epoch that has a solution must not come a second time, by its sentences.
        let solves = self.solved_us.is_some_and(|solved_us| at_us.saturating_sub(solved_us) < SOLUTION_SILENT_US);
        if solves || self.phase == Phase::Solves { fix } else { self.take_nmea(at_us, byte) }
    }

    fn take_nmea(&mut self, at_us: u64, byte: u8) -> Option<Stamped<Option<FixReading>>> {
        if at_us.saturating_sub(self.byte_us) > EPOCH_PAUSE_US {
            self.epoch_us = at_us;
        }
        self.byte_us = at_us;
        let value = self.nmea.take(byte)?;
        (self.heard_us, self.used_baud) = (at_us, self.baud);
        Some(Stamped { value, at_us: self.epoch_us.saturating_sub(DELAY_US) })
    }

    /// Returns what is to be done at `now_us`, one thing after the other until there is nothing; to be called again
    /// after [`take`](Self::take), and every 50 ms.
    pub fn poll(&mut self, now_us: u64) -> Option<ReceiverAction> {
        // The other phases ask, and end by answers that do not come.
        let silent_us = match self.phase {
            Phase::Solves => SOLUTION_SILENT_US,
            Phase::Nmea => NMEA_SILENT_US,
            _ => u64::MAX,
        };
        if now_us.saturating_sub(self.heard_us) > silent_us {
            self.search(now_us);
        }
        loop {
            if core::mem::take(&mut self.sets_baud) {
                return Some(ReceiverAction::Baud(self.baud));
            }
            if now_us < self.ask_us {
                return None;
            }
            let asks = self.asked < ASK_MAX;
            match self.phase {
                Phase::Searches | Phase::Confirms(..) if asks => return Some(self.ask_version(now_us, ASK_US)),
                Phase::Searches => self.conclude(now_us),
                Phase::Confirms(..) => {
                    self.keeps_baud = true;
                    self.search(now_us);
                }
                Phase::Configures(interface, number) => match self.step(interface, number) {
                    Some((command, Worth::Line(baud))) => {
                        self.phase = Phase::Confirms(interface, number);
                        (self.sets_baud, self.baud) = (baud != self.baud, baud);
                        (self.asked, self.owed, self.ask_us) = (0, 1, now_us.saturating_add(CHANGE_US));
                        return Some(ReceiverAction::Send(command));
                    }
                    Some((command, _)) if asks => {
                        (self.asked, self.ask_us) = (self.asked + 1, now_us.saturating_add(ASK_US));
                        return Some(ReceiverAction::Send(command));
                    }
                    // A refusal shows that the line works, and so will sentences; silence may be the wrong baud rate.
                    Some((_, Worth::Needed)) if self.refused => self.take_as_it_is(now_us),
                    Some((_, Worth::Needed)) => self.search(now_us),
                    Some(_) => self.enter_next(interface, number, 0, now_us),
                    None => {
                        self.keeps_baud = false;
                        self.enter(Phase::Solves, now_us);
                    }
                },
                Phase::Nmea => return Some(self.ask_version(now_us, POLL_US)),
                Phase::Solves => return None,
            }
        }
    }

    fn ask_version(&mut self, now_us: u64, pause_us: u64) -> ReceiverAction {
        (self.asked, self.ask_us) = (self.asked.saturating_add(1), now_us.saturating_add(pause_us));
        ReceiverAction::Send(UbxCommand::new(MON_VER, &[]))
    }

    fn step(&self, interface: Interface, number: u8) -> Option<(UbxCommand, Worth)> {
        let baud = if self.keeps_baud { self.baud } else { self.baud.max(FAST_BAUD) };
        step(interface, number, baud)
    }

    /// Uses it by NMEA, and asks later.
    fn take_as_it_is(&mut self, now_us: u64) {
        self.enter(Phase::Nmea, now_us);
        self.ask_us = now_us.saturating_add(POLL_US);
    }

    fn enter(&mut self, phase: Phase, now_us: u64) {
        (self.phase, self.heard_us) = (phase, now_us);
        (self.asked, self.owed, self.refused, self.ask_us) = (0, 0, false, now_us);
    }

    /// Looks for a receiver, first where it was.
    fn search(&mut self, now_us: u64) {
        self.searches = self.searches.saturating_add(1);
        self.try_place(0, now_us);
    }

    fn try_place(&mut self, place: usize, now_us: u64) {
        let places = [self.used_baud, self.found_baud].into_iter().chain(BAUDS);
        self.baud = places.clone().nth(place).unwrap_or(FAST_BAUD);
        // The first two are not tried twice.
        self.place = if place + 1 < places.count() { place + 1 } else { 2 };
        (self.sets_baud, self.solved_us, self.sentences) = (true, None, self.nmea.good_sentences());
        self.enter(Phase::Searches, now_us);
    }

    /// Concludes from what was heard at this baud rate without an answer.
    fn conclude(&mut self, now_us: u64) {
        if self.solved_us.is_some() {
            // It was configured before, and does not hear.
            self.enter(Phase::Solves, now_us);
        } else if self.nmea.good_sentences() != self.sentences {
            self.take_as_it_is(now_us);
        } else {
            self.try_place(self.place, now_us);
        }
    }

    fn identified(&mut self, interface: Interface, now_us: u64) {
        match self.phase {
            Phase::Searches | Phase::Nmea => {
                // A fast rate may be what was set here before; a reset takes the receiver back to its own.
                if self.baud < FAST_BAUD {
                    self.found_baud = self.baud;
                }
                self.enter(Phase::Configures(interface, 0), now_us);
            }
            Phase::Confirms(interface, number) => {
                self.enter_next(interface, number, self.owed, now_us);
            }
            _ => (),
        }
    }

    fn answered(&mut self, to: MessageId, accepted: bool, now_us: u64) {
        let (Phase::Configures(interface, number) | Phase::Confirms(interface, number)) = self.phase else { return };
        if self.step(interface, number).is_none_or(|(command, _)| command.id() != to) {
            return;
        }
        // All keys have the same command: first come the answers to earlier steps, or to one that sets the baud rate.
        if self.owed > 0 {
            self.owed -= 1;
        } else if self.asked == 0 || matches!(self.phase, Phase::Confirms(..)) {
            // To nothing that is known.
        } else if accepted {
            // A refusal is asked about again, and was the answer to what came before.
            let owed = if self.refused { 0 } else { self.asked.saturating_sub(1) };
            self.enter_next(interface, number, owed, now_us);
        } else {
            (self.refused, self.ask_us) = (true, now_us.saturating_add(REFUSED_US));
        }
    }

    /// Begins the step after this one, while so many answers may still come.
    fn enter_next(&mut self, interface: Interface, number: u8, owed: u8, now_us: u64) {
        self.enter(Phase::Configures(interface, number.saturating_add(1)), now_us);
        // Each message has answers of its own.
        self.owed = if interface == Interface::Keys { owed } else { 0 };
    }
}

fn read(id: MessageId, payload: &[u8]) -> Message {
    match (id, payload) {
        // The poll itself, echoed, has no payload.
        (MON_VER, [_, ..]) => Message::Version(Interface::of(payload)),
        (ACK_ACK | ACK_NAK, &[class, number]) => Message::Answer([class, number], id == ACK_ACK),
        (NAV_PVT, _) => solution::read(payload).map_or(Message::Other, Message::Solution),
        _ => Message::Other,
    }
}

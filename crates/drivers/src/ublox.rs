//! u-blox receivers with their binary protocol (UBX), and any other receiver with NMEA.
//!
//! [`UbxReceiver`] finds the baud rate, polls the version and configures the receiver in RAM:
//!
//! - navigation solutions (NAV-PVT) at 10 Hz, or at 5 Hz for the eighth generation and earlier,
//! - no NMEA,
//! - the dynamic model of an aircraft with less than 4 g,
//! - 115,200 baud unless the line is faster.
//!
//! A solution has the velocity in all axes and the receiver's own accuracy estimates. `hAcc`, `vAcc` and `sAcc` are
//! taken as standard deviations along each axis. Sources: u-blox's interface descriptions of M8 (UBX-13003221), M9
//! (UBX-19035940) and M10 (UBX-21035062).
//!
//! | fault | detected by | reaction |
//! |---|---|---|
//! | wrong baud rate, no receiver | no valid message in 1.1 s | next baud rate |
//! | no answer to the version poll, but NMEA | three polls | fixes from NMEA, and a poll every 5 s |
//! | configuration step refused or not answered | three times | step skipped; without NAV-PVT, NMEA |
//! | garbled, lost or foreign bytes | checksum, pause of 0.2 s | search for a frame within the damaged one |
//! | silence, reset | 1 s without a solution, 3 s without NMEA | search and configure, first at the last baud rate |
//! | no fix, or one that the receiver does not trust | `fixType`, `flags`, `flags3` | epoch without a fix |
//! | impossible numbers | receivers' limits; accuracies of 0, or beyond 200 m and 20 m/s | epoch without a fix |
//!
//! The time of a fix is the arrival of the first byte of its frame, or of its epoch in NMEA, minus [`DELAY_US`].
//!
//! The crate `ublox` is not used, since it panics on frames with a correct checksum and unknown numbers. The tests
//! compare messages and keys with it.

mod configuration;
mod frame;
mod solution;

use crate::nmea::NmeaDecoder;
use crate::reading::GnssReading;
use afbc_types::Stamped;
use configuration::{ACK_ACK, ACK_NAK, FAST_BAUD, Importance, Interface, MON_VER, NAV_PVT, step};
pub use frame::UbxCommand;
use frame::{FrameDecoder, MessageId};

/// Age of a solution when the first byte of its frame arrives \[us\]: the 0.12 s that ArduPilot's flight logs show for
/// a complete frame, minus the time of a frame.
pub const DELAY_US: u64 = 110_000;
/// Baud rates in the order of the search. The rates where the receiver was last used and last found come before them;
/// at first, these are the usual ones of configured and of new receivers.
pub const BAUDS: [u32; 6] = [9_600, 57_600, 38_400, 115_200, 230_400, 460_800];
const NEW_BAUD: u32 = 38_400;
/// Number of times that something is asked, and the time for an answer \[us\]. Together they are longer than an epoch
/// of NMEA.
const ASK_MAX: u8 = 3;
const ASK_US: u64 = 370_000;
/// Time for a receiver to change its baud rate \[us\].
const CHANGE_US: u64 = 100_000;
/// Pause after a refusal before asking again \[us\].
const REFUSED_US: u64 = 50_000;
/// Time between two polls of a receiver used with NMEA \[us\].
const POLL_US: u64 = 5_000_000;
/// Time without a solution, and without an epoch of NMEA, after which the receiver is searched for \[us\].
const SOLUTION_SILENT_US: u64 = 1_000_000;
const NMEA_SILENT_US: u64 = 3_000_000;
/// Smallest pause between two epochs of NMEA \[us\].
const EPOCH_PAUSE_US: u64 = 20_000;
/// Number of bits per byte on the line.
const BYTE_BITS: u64 = 10;

/// Action for the caller's UART.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ReceiverAction {
    /// Change the UART's baud rate, after everything sent has left.
    Baud(u32),
    /// Send this command.
    Send(UbxCommand),
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum UbxPhase {
    /// Tries a baud rate.
    Searches,
    /// Sends this step of the configuration.
    Configures(Interface, u8),
    /// Waits for an answer at the baud rate that this step has set.
    Confirms(Interface, u8),
    /// The receiver is configured and sends solutions.
    Solves,
    /// The receiver is not configured; uses its NMEA.
    Nmea,
}

/// Decoded message of the receiver.
enum UbxMessage {
    Version(Interface),
    Answer(MessageId, bool),
    Solution(Option<GnssReading>),
    Other,
}

/// A GNSS receiver on a UART, without I/O: the caller passes the UART's bytes to [`take`](Self::take), and
/// [`poll`](Self::poll) returns the actions for the UART.
pub struct UbxReceiver {
    frames: FrameDecoder,
    nmea: NmeaDecoder,
    phase: UbxPhase,
    /// The UART's baud rate, and whether the caller has yet to set it.
    baud: u32,
    sets_baud: bool,
    /// Baud rates at which the receiver was last used, and at which it was found before being configured.
    used_baud: u32,
    found_baud: u32,
    /// Index of the next baud rate in the search.
    place: usize,
    /// Number of times asked.
    asked: u8,
    /// Number of answers that may still arrive for the last step, which was sent more than once.
    owed: u8,
    refused: bool,
    ask_us: u64,
    /// True if the receiver's baud rate could not be changed.
    keeps_baud: bool,
    /// Times of the newest epoch, the newest solution and the newest byte \[us\].
    heard_us: u64,
    solved_us: Option<u64>,
    byte_us: u64,
    /// Time of the first byte of this epoch of NMEA \[us\].
    epoch_us: u64,
    /// Number of good sentences before this baud rate was tried.
    sentences: u32,
    searches: u32,
}

impl Default for UbxReceiver {
    fn default() -> Self {
        Self::new()
    }
}

impl UbxReceiver {
    /// Creates a receiver of which nothing is known.
    #[must_use]
    pub fn new() -> Self {
        UbxReceiver {
            frames: FrameDecoder::NEW,
            nmea: NmeaDecoder::new(),
            phase: UbxPhase::Searches,
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

    /// True while the receiver is configured and sends navigation solutions.
    #[must_use]
    pub fn is_configured(&self) -> bool {
        self.phase == UbxPhase::Solves
    }

    /// Returns the number of damaged frames and sentences, caused by a bad line or a wrong baud rate.
    #[must_use]
    pub fn damaged(&self) -> u32 {
        self.frames.damaged().saturating_add(self.nmea.bad_sentences())
    }

    /// Returns the number of times that the receiver fell silent and was searched for.
    #[must_use]
    pub fn searches(&self) -> u32 {
        self.searches
    }

    /// Takes a byte that arrived at `at_us`. Returns the fix that it completes, with the time of the fix; the value is
    /// none for an epoch without a fix.
    pub fn take(&mut self, at_us: u64, byte: u8) -> Option<Stamped<Option<GnssReading>>> {
        let byte_us = BYTE_BITS * 1_000_000 / u64::from(self.baud.max(1));
        let mut fix = None;
        self.frames.push(at_us, byte);
        while let Some((first_us, message)) = self.frames.next(byte_us, read) {
            // Bytes of a frame belong to no sentence.
            self.nmea.begin();
            // Sentences after a frame begin a new epoch, however short the pause.
            self.byte_us = 0;
            match message {
                UbxMessage::Version(interface) => self.identified(interface, at_us),
                UbxMessage::Answer(to, accepted) => self.answered(to, accepted, at_us),
                UbxMessage::Solution(value) => {
                    (self.heard_us, self.solved_us, self.used_baud) = (at_us, Some(at_us), self.baud);
                    fix = Some(Stamped { value, at_us: first_us.saturating_sub(DELAY_US) });
                }
                UbxMessage::Other => (),
            }
        }
        // Once solutions come, sentences of the same epoch are ignored.
        let solves = self.solved_us.is_some_and(|solved_us| at_us.saturating_sub(solved_us) < SOLUTION_SILENT_US);
        if solves || self.phase == UbxPhase::Solves { fix } else { self.take_nmea(at_us, byte) }
    }

    fn take_nmea(&mut self, at_us: u64, byte: u8) -> Option<Stamped<Option<GnssReading>>> {
        if at_us.saturating_sub(self.byte_us) > EPOCH_PAUSE_US {
            self.epoch_us = at_us;
        }
        self.byte_us = at_us;
        let value = self.nmea.take(byte)?;
        (self.heard_us, self.used_baud) = (at_us, self.baud);
        Some(Stamped { value, at_us: self.epoch_us.saturating_sub(DELAY_US) })
    }

    /// Returns the next action at `now_us`. To be called until it returns none, after each [`take`](Self::take) and
    /// every 50 ms.
    pub fn poll(&mut self, now_us: u64) -> Option<ReceiverAction> {
        // The other phases time out by unanswered requests.
        let silent_us = match self.phase {
            UbxPhase::Solves => SOLUTION_SILENT_US,
            UbxPhase::Nmea => NMEA_SILENT_US,
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
                UbxPhase::Searches | UbxPhase::Confirms(..) if asks => return Some(self.ask_version(now_us, ASK_US)),
                UbxPhase::Searches => self.conclude(now_us),
                UbxPhase::Confirms(..) => {
                    self.keeps_baud = true;
                    self.search(now_us);
                }
                UbxPhase::Configures(interface, number) => match self.step(interface, number) {
                    Some((command, Importance::Line(baud))) => {
                        self.phase = UbxPhase::Confirms(interface, number);
                        (self.sets_baud, self.baud) = (baud != self.baud, baud);
                        (self.asked, self.owed, self.ask_us) = (0, 1, now_us.saturating_add(CHANGE_US));
                        return Some(ReceiverAction::Send(command));
                    }
                    Some((command, _)) if asks => {
                        (self.asked, self.ask_us) = (self.asked + 1, now_us.saturating_add(ASK_US));
                        return Some(ReceiverAction::Send(command));
                    }
                    // A refusal shows that the line works, so NMEA will, too. Silence may mean a wrong baud rate.
                    Some((_, Importance::Needed)) if self.refused => self.take_as_it_is(now_us),
                    Some((_, Importance::Needed)) => self.search(now_us),
                    Some(_) => self.enter_next(interface, number, 0, now_us),
                    None => {
                        self.keeps_baud = false;
                        self.enter(UbxPhase::Solves, now_us);
                    }
                },
                UbxPhase::Nmea => return Some(self.ask_version(now_us, POLL_US)),
                UbxPhase::Solves => return None,
            }
        }
    }

    fn ask_version(&mut self, now_us: u64, pause_us: u64) -> ReceiverAction {
        (self.asked, self.ask_us) = (self.asked.saturating_add(1), now_us.saturating_add(pause_us));
        ReceiverAction::Send(UbxCommand::new(MON_VER, &[]))
    }

    fn step(&self, interface: Interface, number: u8) -> Option<(UbxCommand, Importance)> {
        let baud = if self.keeps_baud { self.baud } else { self.baud.max(FAST_BAUD) };
        step(interface, number, baud)
    }

    /// Uses the receiver with NMEA, and polls it again later.
    fn take_as_it_is(&mut self, now_us: u64) {
        self.enter(UbxPhase::Nmea, now_us);
        self.ask_us = now_us.saturating_add(POLL_US);
    }

    fn enter(&mut self, phase: UbxPhase, now_us: u64) {
        (self.phase, self.heard_us) = (phase, now_us);
        (self.asked, self.owed, self.refused, self.ask_us) = (0, 0, false, now_us);
    }

    /// Searches for the receiver, first at its last baud rate.
    fn search(&mut self, now_us: u64) {
        self.searches = self.searches.saturating_add(1);
        self.try_place(0, now_us);
    }

    fn try_place(&mut self, place: usize, now_us: u64) {
        let places = [self.used_baud, self.found_baud].into_iter().chain(BAUDS);
        self.baud = places.clone().nth(place).unwrap_or(FAST_BAUD);
        // When the search wraps around, it skips the first two places, which repeat rates of the list.
        self.place = if place + 1 < places.count() { place + 1 } else { 2 };
        (self.sets_baud, self.solved_us, self.sentences) = (true, None, self.nmea.good_sentences());
        self.enter(UbxPhase::Searches, now_us);
    }

    /// Decides how to go on after a baud rate at which the receiver did not answer.
    fn conclude(&mut self, now_us: u64) {
        if self.solved_us.is_some() {
            // The receiver sends solutions but does not hear the requests: it was configured before.
            self.enter(UbxPhase::Solves, now_us);
        } else if self.nmea.good_sentences() != self.sentences {
            self.take_as_it_is(now_us);
        } else {
            self.try_place(self.place, now_us);
        }
    }

    fn identified(&mut self, interface: Interface, now_us: u64) {
        match self.phase {
            UbxPhase::Searches | UbxPhase::Nmea => {
                // A fast rate may have been set by this driver; after a reset, the receiver returns to its own.
                if self.baud < FAST_BAUD {
                    self.found_baud = self.baud;
                }
                self.enter(UbxPhase::Configures(interface, 0), now_us);
            }
            UbxPhase::Confirms(interface, number) => {
                self.enter_next(interface, number, self.owed, now_us);
            }
            _ => (),
        }
    }

    fn answered(&mut self, to: MessageId, accepted: bool, now_us: u64) {
        let (UbxPhase::Configures(interface, number) | UbxPhase::Confirms(interface, number)) = self.phase else {
            return;
        };
        if self.step(interface, number).is_none_or(|(command, _)| command.id() != to) {
            return;
        }
        // All keys use the same command. Answers to earlier steps, or to the step that set the baud rate, come first.
        if self.owed > 0 {
            self.owed -= 1;
        } else if self.asked == 0 || matches!(self.phase, UbxPhase::Confirms(..)) {
            // The answer belongs to no known request.
        } else if accepted {
            // After a refusal the step was sent again, and the refusal answered the earlier request.
            let owed = if self.refused { 0 } else { self.asked.saturating_sub(1) };
            self.enter_next(interface, number, owed, now_us);
        } else {
            (self.refused, self.ask_us) = (true, now_us.saturating_add(REFUSED_US));
        }
    }

    /// Begins the next step. `owed` answers to the present step may still arrive.
    fn enter_next(&mut self, interface: Interface, number: u8, owed: u8, now_us: u64) {
        self.enter(UbxPhase::Configures(interface, number.saturating_add(1)), now_us);
        // Each message type is acknowledged separately, so no answers are owed.
        self.owed = if interface == Interface::Keys { owed } else { 0 };
    }
}

fn read(id: MessageId, payload: &[u8]) -> UbxMessage {
    match (id, payload) {
        // An echo of the poll itself has no payload.
        (MON_VER, [_, ..]) => UbxMessage::Version(Interface::of(payload)),
        (ACK_ACK | ACK_NAK, &[class, number]) => UbxMessage::Answer([class, number], id == ACK_ACK),
        (NAV_PVT, _) => solution::read(payload).map_or(UbxMessage::Other, UbxMessage::Solution),
        _ => UbxMessage::Other,
    }
}

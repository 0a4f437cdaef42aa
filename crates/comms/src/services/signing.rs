//! Message signing: decides which frames are accepted, stamps frames to be signed, and stores the key and the clock.
//!
//! Without a key every frame is accepted and none is signed. With a key every sent frame is signed, and a received
//! frame is ignored if it is unsigned or replayed. SETUP_SIGNING sets or removes the key while the vehicle is disarmed.
//! Its frame must be signed with the present key or come over a wire ([`Decoder::wired`]).
//!
//! [`Decoder::wired`]: afbc_mavlink::Decoder::wired

use afbc_mavlink::{Address, ReceivedFrame, SetupSigning, SigningKey, Stamp, TIME_MAX};
use afbc_store::RecordName;
use heapless::Vec;

/// Number of streams accepted between two starts. A stream is a sender on one of its links.
pub const STREAMS_MAX: usize = 6;
/// Longest time by which the first frame of a sender may be behind the clock \[10 us\]: one minute.
const BEHIND_MAX_10US: u64 = 6_000_000;
/// Largest step by which a sender's frame may move a clock that was set together with the key \[10 us\]: one hour.
/// Frames further ahead are accepted but do not move the clock, so they could be replayed after the next start.
const AHEAD_MAX_10US: u64 = 360_000_000;
/// Latest time stamp that is accepted \[10 us\]: ten years before the 48 bits overflow, so that frames sent later still
/// have time stamps.
const LATEST_10US: u64 = TIME_MAX - 10 * 365 * 86_400 * SECOND_10US;
const SECOND_10US: u64 = 100_000;
/// Period of storing the clock while the vehicle is disarmed \[s\].
const KEPT_EVERY_S: u32 = 120;
/// Link number of the vehicle.
const LINK: u8 = 0;

/// Text of a vehicle without a key.
const OFF: &str = "signing: off, key removed";

/// Names of the records: check value of the key, clock \[s\], words of the key.
const CHECK: &str = "_SIGN_CHECK";
const CLOCK: &str = "_SIGN_TIME";
const WORDS: [&str; 8] = ["_SIGN_0", "_SIGN_1", "_SIGN_2", "_SIGN_3", "_SIGN_4", "_SIGN_5", "_SIGN_6", "_SIGN_7"];

/// Requirement that received frames must meet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Lock {
    /// No requirement.
    #[default]
    Open,
    /// Frames must be signed with this key.
    Signed(SigningKey),
    /// A loss of power has left an incomplete key. No frame is accepted but a new key over a wire.
    Broken,
}

/// The last frame of a sender on one of its links.
#[derive(Clone, Copy, Debug)]
struct Stream {
    from: Address,
    link: u8,
    time_10us: u64,
}

/// A record of the store that is not deleted when the parameters are reset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SigningRecord {
    /// Name of the record.
    pub name: RecordName,
    /// Bits of the record; none to delete it.
    pub bits: Option<u32>,
}

/// Result of a request to change the key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SetupOutcome {
    /// The key was set or removed.
    Done(&'static str),
    /// Reason why the key was not changed.
    Refused(&'static str),
}

/// State of message signing.
#[derive(Clone, Debug, Default)]
pub struct Signing {
    lock: Lock,
    /// Clock at power-up, and time of the last signed frame, since the beginning of 2015 \[10 us\].
    started_10us: u64,
    signed_10us: u64,
    /// Frames of an unknown sender up to this time are ignored \[10 us\]. It is the stored clock at the last start, or
    /// the time at which the same key was set again.
    floor_10us: u64,
    /// True if the clock was set together with a key since the start. Then it is right even if a sender's clock is not.
    is_set: bool,
    streams: Vec<Stream, STREAMS_MAX>,
    /// Stored time of the clock \[s\].
    kept_s: u32,
    /// Index of the next of [`STEPS`](Self::STEPS) records to be stored; none if all are stored.
    unkept: Option<u8>,
    /// True if a key has been refused since the last query.
    refused: bool,
    was_armed: bool,
}

impl Signing {
    /// Number of records to store after a change of the key.
    const STEPS: u8 = 10;

    /// Restores the stored state. `get` returns the record with a name.
    pub fn kept(mut get: impl FnMut(RecordName) -> Option<u32>) -> Self {
        let mut words = [None; WORDS.len()];
        let mut read = |name: &str| RecordName::new(name).and_then(&mut get);
        for (word, name) in words.iter_mut().zip(WORDS) {
            *word = read(name);
        }
        Self::of(read(CHECK), read(CLOCK), words)
    }

    /// Builds the state from check value, clock and words. Not inlined, to save stack during the start.
    #[inline(never)]
    fn of(check: Option<u32>, clock: Option<u32>, words: [Option<u32>; WORDS.len()]) -> Self {
        let kept_s = clock.unwrap_or_default();
        let mut key = SigningKey([0; 32]);
        for (bytes, word) in key.0.chunks_exact_mut(4).zip(&words) {
            bytes.copy_from_slice(&word.unwrap_or_default().to_le_bytes());
        }
        let is_whole = |check| words.iter().all(Option::is_some) && check == u32::from_le_bytes(key.check());
        let lock = match check {
            None => Lock::Open,
            Some(check) if is_whole(check) => Lock::Signed(key),
            Some(_) => Lock::Broken,
        };
        let started_10us = u64::from(kept_s) * SECOND_10US;
        Signing { lock, started_10us, floor_10us: started_10us, kept_s, ..Signing::default() }
    }

    /// Returns true if frames must be signed.
    pub fn is_on(&self) -> bool {
        self.lock != Lock::Open
    }

    /// Returns true once after a key was refused because its frame was not validly signed and did not come over a wire.
    pub fn has_refused(&mut self) -> bool {
        core::mem::take(&mut self.refused)
    }

    /// Returns the clock at `now_us` since power-up \[10 us\].
    fn clock_10us(&self, now_us: u64) -> u64 {
        self.started_10us.saturating_add(now_us / 10).min(TIME_MAX)
    }

    /// Sets the clock forward.
    fn set_clock(&mut self, now_us: u64, time_10us: u64) {
        self.started_10us = self.started_10us.max(time_10us.saturating_sub(now_us / 10));
    }

    /// Returns true if a frame is accepted. `wired` is true if the frame came over a wire.
    pub fn accepts(&mut self, now_us: u64, frame: &ReceivedFrame<'_>, wired: bool) -> bool {
        // A person who has access to the wire could also flash another key.
        let sets_key = frame.id == SetupSigning::ID;
        if sets_key && wired {
            return true;
        }
        let accepted = match self.lock {
            Lock::Open => !sets_key,
            Lock::Signed(key) => self.is_genuine(now_us, frame, &key),
            Lock::Broken => false,
        };
        self.refused |= sets_key && !accepted;
        accepted
    }

    /// Returns true if a frame is signed with the key and newer than the stream's previous frames. Remembers its time.
    fn is_genuine(&mut self, now_us: u64, frame: &ReceivedFrame<'_>, key: &SigningKey) -> bool {
        let Some(Stamp { link, time_10us }) = frame.stamp() else { return false };
        if time_10us > LATEST_10US {
            return false;
        }
        let clock_10us = self.clock_10us(now_us);
        let known = self.streams.iter().position(|stream| stream.from == frame.from && stream.link == link);
        let is_new = match known.and_then(|place| self.streams.get(place)) {
            Some(stream) => time_10us > stream.time_10us,
            None => {
                let is_late = time_10us < clock_10us.saturating_sub(BEHIND_MAX_10US) || time_10us <= self.floor_10us;
                // No stream is replaced: frames of a forgotten sender could be replayed for a minute.
                !is_late && !self.streams.is_full()
            }
        };
        // The time is checked first, so that a replayed frame costs no hash.
        if !is_new || !frame.is_signed_by(key) {
            return false;
        }
        match known.and_then(|place| self.streams.get_mut(place)) {
            Some(stream) => stream.time_10us = time_10us,
            // There is room.
            None => drop(self.streams.push(Stream { from: frame.from, link, time_10us })),
        }
        // A frame far ahead is accepted but must not lock out other senders by moving the clock. After a start the
        // clock does not include the time without power, so it follows the newest frame.
        if !self.is_set || time_10us <= clock_10us.saturating_add(AHEAD_MAX_10US) {
            self.set_clock(now_us, time_10us);
        }
        true
    }

    /// Sets or removes the key. The frame must have been accepted.
    pub fn set(&mut self, now_us: u64, setup: &SetupSigning, armed: bool) -> SetupOutcome {
        if armed {
            return SetupOutcome::Refused("signing key not changed: disarm first");
        }
        if setup.time_10us > LATEST_10US {
            return SetupOutcome::Refused("signing key not changed: invalid timestamp");
        }
        let lock = setup.key.map_or(Lock::Open, Lock::Signed);
        if lock == Lock::Open && !self.is_on() {
            return SetupOutcome::Done(OFF);
        }
        // If the key stays the same, old frames must not be accepted again, and time stamps of sent frames must keep
        // growing. `floor_10us` is 1 below the new time because the sender's next frame may have that time.
        let (floor_10us, signed_10us) =
            if lock == self.lock { (setup.time_10us.saturating_sub(1), self.signed_10us) } else { (0, 0) };
        // A clock that was wrong is replaced, and senders are forgotten.
        let started_10us = setup.time_10us.saturating_sub(now_us / 10);
        let was_armed = self.was_armed;
        let new = Signing { lock, started_10us, signed_10us, floor_10us, was_armed, ..Signing::default() };
        *self = Signing { is_set: true, unkept: Some(0), ..new };
        SetupOutcome::Done(if self.is_on() { "signing: on, key set" } else { OFF })
    }

    /// Returns the key and the stamp of the next frame if it is to be signed.
    pub fn stamp(&mut self, now_us: u64) -> Option<(&SigningKey, Stamp)> {
        // Two frames within 10 us must not have the same time, or the second one would count as a replay.
        let time_10us = self.clock_10us(now_us).max(self.signed_10us.saturating_add(1));
        let Lock::Signed(key) = &self.lock else { return None };
        self.signed_10us = time_10us;
        Some((key, Stamp { link: LINK, time_10us }))
    }

    /// Returns the next record to be stored. Each record is returned once.
    pub fn record(&mut self, now_us: u64, armed: bool) -> Option<SigningRecord> {
        let landed = core::mem::replace(&mut self.was_armed, armed) && !armed;
        let Some(record) = self.unkept else { return self.clock_record(now_us, armed, landed) };
        self.unkept = Some(record + 1).filter(|next| *next < Self::STEPS);
        let (name, bits) = match self.lock {
            Lock::Signed(key) => match WORDS.get(usize::from(record)) {
                // The check value is stored last: until then there is no key, or the key counts as incomplete.
                Some(name) => {
                    let word = key.0.chunks_exact(4).nth(usize::from(record)).and_then(|word| word.first_chunk());
                    (*name, word.copied().map(u32::from_le_bytes))
                }
                None if record == 8 => (CHECK, Some(u32::from_le_bytes(key.check()))),
                None => return self.clock_record(now_us, false, true),
            },
            _ => match record.checked_sub(1) {
                // The check value is deleted first: without it there is no key.
                None => (CHECK, None),
                Some(word) => (WORDS.get(usize::from(word)).copied().unwrap_or(CHECK), None),
            },
        };
        RecordName::new(name).map(|name| SigningRecord { name, bits })
    }

    /// Returns the clock's record if it is to be stored again: `at_once`, or after [`KEPT_EVERY_S`].
    fn clock_record(&mut self, now_us: u64, armed: bool, at_once: bool) -> Option<SigningRecord> {
        if armed || !self.is_on() {
            return None;
        }
        // The time is rounded up, so that frames accepted before are older than the stored clock.
        let now_s = self.clock_10us(now_us).div_ceil(SECOND_10US) as u32;
        if now_s < self.kept_s.saturating_add(if at_once { 1 } else { KEPT_EVERY_S }) {
            return None;
        }
        self.kept_s = now_s;
        RecordName::new(CLOCK).map(|name| SigningRecord { name, bits: Some(now_s) })
    }
}

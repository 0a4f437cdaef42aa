//! Signed frames: which are accepted, what is signed, and what of it is kept.
//!
//! Without a key every frame is accepted and none is signed. With one, everything that is sent is signed, and what
//! is not signed with it, or was sent before, is not heard. A key is set or removed by SETUP_SIGNING while the vehicle
//! is disarmed: by a frame signed with the present key, or by any frame over a wire ([`Decoder::wired`]).
//!
//! [`Decoder::wired`]: afbc_link::Decoder::wired

use afbc_link::{Address, Key, ReceivedFrame, SetupSigning, Stamp, TIME_MAX};
use afbc_store::RecordName;
use heapless::Vec;

/// Senders by one of their links that are accepted between two starts.
pub const STREAMS_MAX: usize = 6;
/// How far the first frame of a sender may be behind the clock \[10 us\]: a minute.
const BEHIND_MAX_10US: u64 = 6_000_000;
/// How far a sender may move on the clock that has come with the key \[10 us\]: an hour. What is further ahead is heard
/// but not remembered beyond the next start, so it could be replayed then.
const AHEAD_MAX_10US: u64 = 360_000_000;
/// Latest time that a frame may have \[10 us\]: ten years before the wire's 48 bits end, so that those that are sent
/// later have times of their own.
const LATEST_10US: u64 = TIME_MAX - 10 * 365 * 86_400 * SECOND_10US;
const SECOND_10US: u64 = 100_000;
/// Seconds that the clock runs before it is kept again while the vehicle is disarmed.
const KEPT_EVERY_S: u32 = 120;
/// The vehicle's own link.
const LINK: u8 = 0;

/// Text on a vehicle that has no key.
const OFF: &str = "signing: off, no key";

/// Names of the records: check of the key, seconds of the clock, words of the key.
const CHECK: &str = "_SIGN_CHECK";
const CLOCK: &str = "_SIGN_TIME";
const WORDS: [&str; 8] = ["_SIGN_0", "_SIGN_1", "_SIGN_2", "_SIGN_3", "_SIGN_4", "_SIGN_5", "_SIGN_6", "_SIGN_7"];

/// What frames need.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Lock {
    /// Nothing.
    #[default]
    Open,
    /// A signature with this key.
    Signed(Key),
    /// There is a key, of which a cut of power has left a part: nothing is accepted but a new one over a wire.
    Broken,
}

/// The last frame of a sender by one of its links.
#[derive(Clone, Copy, Debug)]
struct Stream {
    from: Address,
    link: u8,
    time_10us: u64,
}

/// A record of the store that outlasts the parameters' return to their defaults.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SigningRecord {
    /// Its name.
    pub name: RecordName,
    /// Its bits; none to take it back.
    pub bits: Option<u32>,
}

/// What a request to change the key came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SetupOutcome {
    /// There is a key now, or none.
    Done(&'static str),
    /// Why not.
    Refused(&'static str),
}

/// The signatures' state.
#[derive(Clone, Debug, Default)]
pub struct Signing {
    lock: Lock,
    /// The clock at power-up, and of the last frame signed, since the beginning of 2015 \[10 us\].
    started_10us: u64,
    signed_10us: u64,
    /// What a sender that is not known has sent up to here is not heard: the clock that was kept at the last start, or
    /// that has come with the same key again \[10 us\].
    floor_10us: u64,
    /// True if the clock has come with the key since the start: it is right, whatever a sender's is.
    is_set: bool,
    streams: Vec<Stream, STREAMS_MAX>,
    /// Seconds of the clock that are kept.
    kept_s: u32,
    /// Records yet to be kept, of [`STEPS`](Self::STEPS): the first of them; none if all are.
    unkept: Option<u8>,
    /// True if a key has been refused since this was last asked.
    refused: bool,
    was_armed: bool,
}

impl Signing {
    /// Records of a change of the key.
    const STEPS: u8 = 10;

    /// Reads what is kept; `get` returns the record of a name.
    pub fn kept(mut get: impl FnMut(RecordName) -> Option<u32>) -> Self {
        let mut words = [None; WORDS.len()];
        let mut read = |name: &str| RecordName::new(name).and_then(&mut get);
        for (word, name) in words.iter_mut().zip(WORDS) {
            *word = read(name);
        }
        Self::of(read(CHECK), read(CLOCK), words)
    }

    /// Makes it of check, clock and words. Out of line, so that the start's stack does not have it.
    #[inline(never)]
    fn of(check: Option<u32>, clock: Option<u32>, words: [Option<u32>; WORDS.len()]) -> Self {
        let kept_s = clock.unwrap_or_default();
        let mut key = Key([0; 32]);
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

    /// True if frames need a signature.
    pub fn is_on(&self) -> bool {
        self.lock != Lock::Open
    }

    /// True once if a key has come over a link that is no wire, and was not set.
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

    /// True if a frame is heard, which has come over a wire or not.
    pub fn accepts(&mut self, now_us: u64, frame: &ReceivedFrame<'_>, wired: bool) -> bool {
        // Whoever holds the wire could as well flash another key.
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

    /// True if a frame is signed with the key and newer than all of its sender; the next must be newer than this one.
    fn is_genuine(&mut self, now_us: u64, frame: &ReceivedFrame<'_>, key: &Key) -> bool {
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
                // No sender gives way: frames of one that is forgotten, up to a minute old, could be replayed.
                !is_late && !self.streams.is_full()
            }
        };
        // The time first: what is replayed costs no hash.
        if !is_new || !frame.is_signed_by(key) {
            return false;
        }
        match known.and_then(|place| self.streams.get_mut(place)) {
            Some(stream) => stream.time_10us = time_10us,
            // There is room.
            None => drop(self.streams.push(Stream { from: frame.from, link, time_10us })),
        }
        // One whose clock is ahead is heard, and must not lock others out. After a start nobody knows how long the
        // vehicle has been off: the newest frame says it.
        if !self.is_set || time_10us <= clock_10us.saturating_add(AHEAD_MAX_10US) {
            self.set_clock(now_us, time_10us);
        }
        true
    }

    /// Sets or removes the key, for a frame that was accepted.
    pub fn set(&mut self, now_us: u64, setup: &SetupSigning, armed: bool) -> SetupOutcome {
        if armed {
            return SetupOutcome::Refused("signing key not changed: armed");
        }
        if setup.time_10us > LATEST_10US {
            return SetupOutcome::Refused("signing key not changed: its time is wrong");
        }
        let lock = setup.key.map_or(Lock::Open, Lock::Signed);
        if lock == Lock::Open && !self.is_on() {
            return SetupOutcome::Done(OFF);
        }
        // With the same key, what was signed before does not count again, and what is sent goes on to grow. The next
        // frame of whoever sets it may have the same time.
        let (floor_10us, signed_10us) =
            if lock == self.lock { (setup.time_10us.saturating_sub(1), self.signed_10us) } else { (0, 0) };
        // A clock that was set wrong does not stay so, nor do senders that are not there any more.
        let started_10us = setup.time_10us.saturating_sub(now_us / 10);
        let was_armed = self.was_armed;
        let new = Signing { lock, started_10us, signed_10us, floor_10us, was_armed, ..Signing::default() };
        *self = Signing { is_set: true, unkept: Some(0), ..new };
        SetupOutcome::Done(if self.is_on() { "signing: on, key set" } else { OFF })
    }

    /// Returns key and stamp of the next frame to be sent, if it is to be signed.
    pub fn stamp(&mut self, now_us: u64) -> Option<(&Key, Stamp)> {
        // Two frames within 10 us would have one time, and the second would count as a replay.
        let time_10us = self.clock_10us(now_us).max(self.signed_10us.saturating_add(1));
        let Lock::Signed(key) = &self.lock else { return None };
        self.signed_10us = time_10us;
        Some((key, Stamp { link: LINK, time_10us }))
    }

    /// Returns the next record to be kept, once.
    pub fn record(&mut self, now_us: u64, armed: bool) -> Option<SigningRecord> {
        let landed = core::mem::replace(&mut self.was_armed, armed) && !armed;
        let Some(record) = self.unkept else { return self.clock_record(now_us, armed, landed) };
        self.unkept = Some(record + 1).filter(|next| *next < Self::STEPS);
        let (name, bits) = match self.lock {
            Lock::Signed(key) => match WORDS.get(usize::from(record)) {
                // The check last: with half of a key there is none, or a broken one.
                Some(name) => {
                    let word = key.0.chunks_exact(4).nth(usize::from(record)).and_then(|word| word.first_chunk());
                    (*name, word.copied().map(u32::from_le_bytes))
                }
                None if record == 8 => (CHECK, Some(u32::from_le_bytes(key.check()))),
                None => return self.clock_record(now_us, false, true),
            },
            _ => match record.checked_sub(1) {
                // The check first: without it there is no key.
                None => (CHECK, None),
                Some(word) => (WORDS.get(usize::from(word)).copied().unwrap_or(CHECK), None),
            },
        };
        RecordName::new(name).map(|name| SigningRecord { name, bits })
    }

    /// Returns the clock's record, if it is to be kept again: `at_once`, or after some time.
    fn clock_record(&mut self, now_us: u64, armed: bool, at_once: bool) -> Option<SigningRecord> {
        if armed || !self.is_on() {
            return None;
        }
        // Rounded up: what was heard before stays behind.
        let now_s = self.clock_10us(now_us).div_ceil(SECOND_10US) as u32;
        if now_s < self.kept_s.saturating_add(if at_once { 1 } else { KEPT_EVERY_S }) {
            return None;
        }
        self.kept_s = now_s;
        RecordName::new(CLOCK).map(|name| SigningRecord { name, bits: Some(now_s) })
    }
}

//! Message signing with a key: accepted frames, sent frames, and the state after a restart.

use crate::common::{Bench, STATION};
use afbc_comms::services::signing::{STREAMS_MAX, Signing, SigningRecord};
use afbc_mavlink::{
    Address, Decoder, Downlink, Encoder, FRAME_MAX, ReceivedFrame, SIGNED_FRAME_MAX, SetupSigning, SigningKey, Stamp,
    Uplink, VehicleCommand,
};
use afbc_types::State;
use proptest::prelude::*;
use std::collections::BTreeMap;

const KEY: SigningKey = SigningKey([42; 32]);
const OTHER: SigningKey = SigningKey([43; 32]);
/// 26 November 2026 [10 us].
const TODAY_10US: u64 = 37_570_000_000_000;
const MINUTE_10US: u64 = 6_000_000;
const HOUR_10US: u64 = 60 * MINUTE_10US;

type Records = BTreeMap<String, u32>;

/// A vehicle with a key and a station that signs.
struct Locked {
    bench: Bench,
    records: Records,
    sender: Encoder,
    time_10us: u64,
}

impl Locked {
    /// Creates a vehicle with a key that was set over a wire and stored.
    fn new() -> Self {
        let mut locked = Locked {
            bench: Bench::new(),
            records: Records::new(),
            sender: Encoder::new(STATION),
            time_10us: TODAY_10US,
        };
        locked.bench.step();
        locked.set(Some(KEY), true);
        locked.keep(12);
        assert_eq!(locked.records.len(), 10);
        locked
    }

    /// Sends SETUP_SIGNING, unsigned.
    fn set(&mut self, key: Option<SigningKey>, wired: bool) {
        let setup = SetupSigning { key, time_10us: self.time_10us };
        let frame = self.sender.send(&Uplink::Signing(setup), &mut [0; FRAME_MAX]).to_vec();
        let mut decoder = self.bench.comms.decoder();
        decoder = if wired { decoder.wired() } else { decoder };
        let update = self.bench.comms.receive(&mut decoder, &frame);
        self.bench.inputs.merge(&update);
    }

    /// Stores the records of this many ticks.
    fn keep(&mut self, ticks: usize) {
        for _ in 0..ticks {
            self.bench.step();
            let Some(SigningRecord { name, bits }) = self.bench.comms.signing_record() else { continue };
            match bits {
                Some(bits) => drop(self.records.insert(name.as_str().into(), bits)),
                None => drop(self.records.remove(name.as_str())),
            }
        }
    }

    /// Restarts the vehicle with the stored records.
    fn restart(&mut self) {
        self.bench = Bench::new();
        let records = &self.records;
        self.bench.comms.set_signing(Signing::kept(|name| records.get(name.as_str()).copied()));
        self.bench.step();
    }

    fn signed(&mut self, message: &Uplink, key: &SigningKey) -> Vec<u8> {
        self.time_10us += 1;
        let stamp = Stamp { link: 3, time_10us: self.time_10us };
        self.sender.send_signed(message, Some((key, stamp)), &mut [0; SIGNED_FRAME_MAX]).to_vec()
    }

    /// Returns true if the vehicle answers a command in these bytes.
    fn hears(&mut self, bytes: &[u8]) -> bool {
        self.bench.hear_bytes(bytes);
        answers(&mut self.bench) > 0
    }
}

/// Returns the number of answers to commands in the next ticks, signed or not.
fn answers(bench: &mut Bench) -> usize {
    (0..5).map(|_| frames(bench).1.iter().filter(|it| matches!(it, Downlink::CommandAck { .. })).count()).sum()
}

/// Runs a tick. Returns the frames sent and the messages in them.
fn frames(bench: &mut Bench) -> (Vec<Vec<u8>>, Vec<Downlink>) {
    bench.now_us += 1000;
    bench.inputs.take_into(&mut bench.taken);
    let report = bench.flight.tick(bench.now_us, &mut bench.taken, &afbc_onboard::Readings::NONE);
    let (mut frames, mut messages) = (Vec::new(), Vec::new());
    bench.comms.report(&report, 0.0, |frame| frames.push(frame.to_vec()));
    let mut decoder = Decoder::new(STATION);
    frames.iter().for_each(|frame| decoder.feed_accepted(frame, |_| true, |_, message| messages.push(message)));
    (frames, messages)
}

/// Returns a command that the vehicle answers at once in any state.
fn command() -> Uplink {
    Uplink::Command(VehicleCommand::Other(31_999))
}

#[test]
fn only_what_is_signed_and_new_is_heard() {
    let mut locked = Locked::new();
    let unsigned = Encoder::new(STATION).send(&command(), &mut [0; FRAME_MAX]).to_vec();
    assert!(!locked.hears(&unsigned));
    let forged = locked.signed(&command(), &OTHER);
    assert!(!locked.hears(&forged));
    let genuine = locked.signed(&command(), &KEY);
    assert!(locked.hears(&genuine));
    assert!(!locked.hears(&genuine), "once more");
    let later = locked.signed(&command(), &KEY);
    let latest = locked.signed(&command(), &KEY);
    assert!(locked.hears(&latest));
    assert!(!locked.hears(&later), "in the wrong order");
    // This frame was captured long ago, from a sender that has not been heard since the restart.
    let stamp = Stamp { link: 9, time_10us: TODAY_10US - 2 * MINUTE_10US };
    let old = Encoder::new(Address { system: 7, component: 7 })
        .send_signed(&command(), Some((&KEY, stamp)), &mut [0; SIGNED_FRAME_MAX])
        .to_vec();
    assert!(!locked.hears(&old));
}

/// The refusal of a key is announced to all stations. Accepted keys and unsigned frames cause no such text.
#[test]
fn a_key_that_is_refused_is_told_of() {
    const REFUSED: &str = "signing key refused: send it by wire or signed";
    let told = |locked: &mut Locked| {
        let is_it =
            |it: &Downlink| matches!(it, Downlink::Text { text, .. } if text.to_str().is_ok_and(|it| it == REFUSED));
        (0..5).map(|_| frames(&mut locked.bench).1.iter().filter(|it| is_it(it)).count()).sum::<usize>()
    };
    let mut locked = Locked::new();
    locked.set(Some(OTHER), false);
    assert_eq!((told(&mut locked), told(&mut locked)), (1, 0), "once");
    locked.bench.hear(command());
    assert_eq!(told(&mut locked), 0);
    for (key, by) in [(OTHER, KEY), (KEY, OTHER)] {
        let setup = SetupSigning { key: Some(key), time_10us: locked.time_10us };
        let signed = locked.signed(&Uplink::Signing(setup), &by);
        locked.bench.hear_bytes(&signed);
        assert_eq!(told(&mut locked), 0);
    }
    locked.set(Some(OTHER), true);
    assert_eq!(told(&mut locked), 0);
}

#[test]
fn without_a_key_everything_is_heard_and_nothing_signed() {
    let mut locked = Locked::new();
    locked.set(None, true);
    locked.keep(12);
    assert_eq!(locked.records.keys().collect::<Vec<_>>(), ["_SIGN_TIME"]);
    for restarts in [false, true] {
        if restarts {
            locked.restart();
        }
        let genuine = locked.signed(&command(), &KEY);
        assert!(locked.hears(&genuine) && locked.hears(&genuine));
        let unsigned = Encoder::new(STATION).send(&command(), &mut [0; FRAME_MAX]).to_vec();
        assert!(locked.hears(&unsigned));
        let (sent, _) = (0..1000).map(|_| frames(&mut locked.bench)).find(|(sent, _)| !sent.is_empty()).expect("some");
        assert!(sent.iter().all(|frame| frame[2] == 0));
    }
}

#[test]
fn all_that_is_sent_is_signed_with_growing_times() {
    let mut locked = Locked::new();
    let (mut last, mut count) = (TODAY_10US, 0);
    for _ in 0..3000 {
        for frame in frames(&mut locked.bench).0 {
            let accept = |frame: &ReceivedFrame<'_>| {
                let stamp = frame.stamp().expect("signed");
                assert!(frame.is_signed_by(&KEY) && stamp.time_10us > last, "{stamp:?} after {last}");
                last = stamp.time_10us;
                true
            };
            Decoder::new(STATION).feed_accepted(&frame, accept, |_, _: Downlink| count += 1);
        }
    }
    // All frames of three seconds are on the station's clock.
    assert!(count > 50, "{count}");
    assert!(last < TODAY_10US + 400_000, "{last}");
}

#[test]
fn a_key_is_set_over_a_wire_or_signed_and_never_while_armed() {
    let mut open =
        Locked { bench: Bench::new(), records: Records::new(), sender: Encoder::new(STATION), time_10us: TODAY_10US };
    open.set(Some(OTHER), false);
    let unsigned = Encoder::new(STATION).send(&command(), &mut [0; FRAME_MAX]).to_vec();
    assert!(open.hears(&unsigned), "set without a wire");

    let mut locked = Locked::new();
    let setup = SetupSigning { key: Some(OTHER), time_10us: TODAY_10US };
    let signed = locked.signed(&Uplink::Signing(setup), &KEY);
    locked.bench.hear_bytes(&signed);
    let genuine = locked.signed(&command(), &OTHER);
    assert!(locked.hears(&genuine), "the new key");
    let former = locked.signed(&command(), &KEY);
    assert!(!locked.hears(&former), "the former key");

    let mut armed = Bench::flying();
    let setup = SetupSigning { key: Some(KEY), time_10us: TODAY_10US };
    let frame = Encoder::new(STATION).send(&Uplink::Signing(setup), &mut [0; FRAME_MAX]).to_vec();
    let mut decoder = armed.comms.decoder().wired();
    let update = armed.comms.receive(&mut decoder, &frame);
    armed.inputs.merge(&update);
    armed.hear(command());
    let (_, said) = armed.tick(&State::default());
    assert!(said.iter().any(|it| matches!(it, Downlink::CommandAck { .. })), "still unsigned: {said:?}");
}

#[test]
fn a_start_forgets_neither_key_nor_clock() {
    let mut locked = Locked::new();
    let before = locked.signed(&command(), &KEY);
    // Two hours pass, in which frames are accepted.
    locked.time_10us += 120 * MINUTE_10US;
    locked.bench.now_us += 120 * 10 * MINUTE_10US;
    locked.bench.step();
    let at_last = locked.signed(&command(), &KEY);
    assert!(locked.hears(&at_last));
    locked.keep(3);
    locked.restart();
    assert!(!locked.hears(&before), "two hours old");
    assert!(!locked.hears(&at_last), "replayed before anything else is heard");
    // Some time passes, so the station's next frame is newer than all earlier frames.
    locked.time_10us += 100_000;
    let genuine = locked.signed(&command(), &KEY);
    assert!(locked.hears(&genuine));
    assert!(!locked.hears(&at_last), "replayed");
}

/// A frame accepted before a restart is not accepted again after it, even if its sender's clock is up to an hour ahead.
#[test]
fn a_start_lets_no_frame_be_replayed() {
    for ahead_10us in [10, MINUTE_10US + 10, 5 * MINUTE_10US, HOUR_10US - MINUTE_10US] {
        let mut locked = Locked::new();
        locked.time_10us += ahead_10us;
        let frame = locked.signed(&command(), &KEY);
        assert!(locked.hears(&frame), "{ahead_10us}");
        locked.keep(12);
        // The clock is stored every two minutes.
        locked.bench.now_us += 121_000_000;
        locked.keep(3);
        locked.restart();
        assert!(!locked.hears(&frame), "{ahead_10us}");
    }
}

/// A sender with the key whose clock is a year ahead is accepted and does not lock out others. After a restart it does,
/// if the clock has not been set since. Setting the same or another key corrects the clock, whatever the sender sends
/// later.
#[test]
fn a_clock_that_is_a_year_ahead_is_set_right_by_a_key() {
    const YEAR_10US: u64 = 365 * 24 * 60 * MINUTE_10US;
    let newcomer = |locked: &mut Locked, system, time_10us, key: &SigningKey| {
        let stamp = Stamp { link: 9, time_10us };
        let mut sender = Encoder::new(Address { system, component: 7 });
        let frame = sender.send_signed(&command(), Some((key, stamp)), &mut [0; SIGNED_FRAME_MAX]).to_vec();
        locked.hears(&frame)
    };
    for (restarts, key) in [(false, KEY), (true, KEY), (false, OTHER), (true, OTHER)] {
        let mut locked = Locked::new();
        if restarts {
            locked.restart();
        }
        let right_10us = locked.time_10us + MINUTE_10US;
        locked.time_10us = right_10us + YEAR_10US;
        let ahead = locked.signed(&command(), &KEY);
        assert!(locked.hears(&ahead));
        locked.keep(3);
        assert_eq!(newcomer(&mut locked, 7, right_10us, &KEY), !restarts, "one whose clock is right");
        locked.time_10us = right_10us + 100;
        locked.set(Some(key), true);
        assert_eq!(newcomer(&mut locked, 7, right_10us, &key), key == OTHER, "once more with the same key");
        let genuine = locked.signed(&command(), &key);
        assert!(locked.hears(&genuine), "who has set the key");
        assert!(newcomer(&mut locked, 8, right_10us + YEAR_10US, &key), "one that is ahead");
        assert!(newcomer(&mut locked, 9, right_10us + 200, &key), "one whose clock is right");
        locked.keep(12);
        locked.restart();
        assert!(newcomer(&mut locked, 9, right_10us + 3 * MINUTE_10US, &key), "after another start");
    }
}

/// Time stamps near the end of the 48 bits are refused, so that sent frames still have time stamps of their own.
#[test]
fn the_end_of_time_is_not_heard() {
    const TEN_YEARS_10US: u64 = 10 * 365 * 24 * HOUR_10US;
    for before_10us in [0, 10, 1_000_000_000, TEN_YEARS_10US - 10] {
        let time_10us = afbc_mavlink::TIME_MAX - before_10us;
        for restarts in [false, true] {
            let mut locked = Locked::new();
            if restarts {
                locked.restart();
            }
            let right_10us = locked.time_10us;
            locked.time_10us = time_10us - 1;
            let last = locked.signed(&command(), &KEY);
            assert!(!locked.hears(&last));
            locked.set(Some(KEY), true);
            locked.time_10us = right_10us + MINUTE_10US;
            let genuine = locked.signed(&command(), &KEY);
            assert!(locked.hears(&genuine), "its clock is as it was");
        }
    }
    // This is the latest time stamp that is accepted.
    let mut locked = Locked::new();
    locked.time_10us = afbc_mavlink::TIME_MAX - TEN_YEARS_10US - 1;
    let last = locked.signed(&command(), &KEY);
    assert!(locked.hears(&last));
}

/// Power fails between any two records. Then the key is the old key, the new key, or an incomplete key that nobody has.
/// The vehicle is never left without signing.
#[test]
fn half_a_key_opens_nothing() {
    for cut in 0..=10 {
        let mut locked = Locked::new();
        locked.set(Some(OTHER), true);
        locked.keep(cut);
        locked.restart();
        let unsigned = Encoder::new(STATION).send(&command(), &mut [0; FRAME_MAX]).to_vec();
        assert!(!locked.hears(&unsigned), "cut after {cut}");
        locked.time_10us += MINUTE_10US;
        let [former, new] = [KEY, OTHER].map(|key| {
            let frame = locked.signed(&command(), &key);
            locked.hears(&frame)
        });
        assert!(!(former && new), "cut after {cut}");
        assert_eq!(former, cut == 0, "cut after {cut}");
        assert_eq!(new, cut >= 9, "cut after {cut}");
        // A person with access to the wire can set a key again.
        locked.set(Some(KEY), true);
        let genuine = locked.signed(&command(), &KEY);
        assert!(locked.hears(&genuine), "cut after {cut}");
    }
}

#[test]
fn more_senders_than_there_is_room_for_are_not_heard() {
    let mut locked = Locked::new();
    for system in 1..20 {
        let mut sender = Encoder::new(Address { system: 100 + system, component: 1 });
        locked.time_10us += 10;
        let stamp = Stamp { link: 0, time_10us: locked.time_10us };
        let frame = sender.send_signed(&command(), Some((&KEY, stamp)), &mut [0; SIGNED_FRAME_MAX]).to_vec();
        assert_eq!(locked.hears(&frame), usize::from(system) <= STREAMS_MAX, "{system}");
    }
}

proptest! {
    /// Frames have random senders, links, times, keys and order; some are unsigned. A frame is accepted exactly if it
    /// is signed with the key and newer than all accepted frames of its stream. The first frame of a stream must not be
    /// more than a minute behind the clock. That clock was set with the key, and other senders move it by an hour at
    /// most.
    #[test]
    fn the_rule_holds(
        sent in prop::collection::vec(
            (
                0..3_u8,
                0..2_u8,
                prop_oneof![3 => 0..5 * MINUTE_10US, 1 => 0..150 * MINUTE_10US],
                prop_oneof![4 => Just(Some(KEY)), 1 => Just(Some(OTHER)), 1 => Just(None)],
            ),
            1..40,
        ),
    ) {
        let mut locked = Locked::new();
        let (mut newest, mut streams) = (TODAY_10US, BTreeMap::new());
        for (system, link, later, key) in sent {
            let from = Address { system: 100 + system, component: 1 };
            let time_10us = TODAY_10US - MINUTE_10US + later;
            let mut buffer = [0; SIGNED_FRAME_MAX];
            let frame = match &key {
                Some(key) => {
                    let stamp = Stamp { link, time_10us };
                    Encoder::new(from).send_signed(&command(), Some((key, stamp)), &mut buffer).to_vec()
                }
                None => Encoder::new(from).send(&command(), &mut [0; FRAME_MAX]).to_vec(),
            };
            // The vehicle's clock advances between two frames.
            let now_10us = newest + locked.bench.now_us / 10;
            let is_new = match streams.get(&(system, link)) {
                Some(last) => time_10us > *last,
                None => time_10us + MINUTE_10US >= now_10us,
            };
            let near = time_10us.abs_diff(now_10us.saturating_sub(MINUTE_10US)) < 100_000;
            if time_10us.abs_diff(now_10us + HOUR_10US) < 100_000 {
                continue;
            }
            let heard = locked.hears(&frame);
            if !near {
                prop_assert_eq!(heard, key == Some(KEY) && is_new);
            }
            if heard {
                streams.insert((system, link), time_10us);
                if time_10us < now_10us + HOUR_10US {
                    newest = newest.max(time_10us.saturating_sub(locked.bench.now_us / 10));
                }
            }
        }
    }
}

//! The stream: pieces, garbage, corruption, truncation.
#![allow(clippy::expect_used, clippy::indexing_slicing, reason = "a test that cannot go on should say why")]

use airframe::{Setpoint, State};
use link::{Address, Command, Counters, Decoder, FRAME_MAX, Sender, Uplink};
use nalgebra::Vector3;
use proptest::prelude::*;

const STATION: Address = Address { system: 255, component: 190 };
const VEHICLE: Address = Address { system: 1, component: 1 };

fn messages() -> impl Strategy<Value = Uplink> {
    let number = -100.0f32..100.0;
    prop_oneof![
        Just(Uplink::Heartbeat),
        Just(Uplink::Command(Command::Arm)),
        Just(Uplink::Command(Command::Disarm)),
        (any::<u64>(), number.clone()).prop_map(|(sent_us, x)| {
            let state = State { position_m: Vector3::new(x, 2.0 * x, 3.0 * x), ..State::default() };
            Uplink::State { sent_us, state }
        }),
        number.prop_map(|x| Uplink::Setpoint(Setpoint { position_m: Vector3::new(x, -x, x), ..Setpoint::default() })),
    ]
}

/// Frames of `messages`, by one sender.
fn frames(messages: &[Uplink]) -> Vec<Vec<u8>> {
    let mut sender = Sender::new(STATION);
    messages.iter().map(|message| sender.send(message, &mut [0; FRAME_MAX]).to_vec()).collect()
}

/// What `chunks` decode to, and the counts.
fn decode<'a>(chunks: impl IntoIterator<Item = &'a [u8]>) -> (Vec<Uplink>, Counters) {
    let mut decoder = Decoder::new(VEHICLE);
    let mut messages = Vec::new();
    for chunk in chunks {
        decoder.feed(chunk, |_, message| messages.push(message));
    }
    (messages, *decoder.counters())
}

/// Long enough to complete whatever garbage pretends to begin.
const FLUSH: [u8; FRAME_MAX] = [0; FRAME_MAX];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    /// No bytes panic or hang it, and every byte is accounted for.
    #[test]
    fn arbitrary_bytes_do_no_harm(bytes in prop::collection::vec(any::<u8>(), 0..2000)) {
        let (messages, counters) = decode([bytes.as_slice()]);
        prop_assert_eq!(messages.len(), counters.received as usize);
        prop_assert!(counters.skipped_bytes as usize <= bytes.len());
    }

    /// As above, with bytes that keep looking like the beginning of a frame.
    #[test]
    fn almost_frames_do_no_harm(bytes in prop::collection::vec(
        prop_oneof![Just(0xFD), Just(0), Just(1), Just(84), Just(76), Just(75), any::<u8>()], 0..2000)
    ) {
        let (messages, counters) = decode([bytes.as_slice()]);
        prop_assert_eq!(messages.len(), counters.received as usize);
    }

    /// It does not matter how the stream is cut.
    #[test]
    fn pieces_make_no_difference(
        messages in prop::collection::vec(messages(), 1..20),
        garbage in prop::collection::vec(any::<u8>(), 0..40),
        cuts in prop::collection::vec(1usize..300, 1..50),
    ) {
        let stream: Vec<u8> = frames(&messages).into_iter().flat_map(|f| [garbage.clone(), f].concat()).collect();
        let whole = decode([stream.as_slice()]);
        prop_assert_eq!(&decode(stream.chunks(1)), &whole);
        let mut rest = stream.as_slice();
        let mut pieces = Vec::new();
        for cut in cuts.iter().cycle() {
            let (piece, behind) = rest.split_at((*cut).min(rest.len()));
            pieces.push(piece);
            rest = behind;
            if rest.is_empty() {
                break;
            }
        }
        prop_assert_eq!(&decode(pieces), &whole);
    }

    /// A frame behind any garbage arrives, at most `FRAME_MAX` bytes later.
    #[test]
    fn a_frame_behind_garbage_arrives(garbage in prop::collection::vec(any::<u8>(), 0..600), message in messages()) {
        let frame = frames(&[message]).concat();
        let (messages, counters) = decode([garbage.as_slice(), &frame, &FLUSH]);
        prop_assert_eq!(messages, [message]);
        prop_assert!(counters.skipped_bytes as usize >= garbage.len());
    }

    /// A truncated frame takes none of the frames behind it along.
    #[test]
    fn a_truncated_frame_costs_itself_only(before in messages(), cut in messages(), after in messages(), keep: prop::sample::Index) {
        let sent = frames(&[before, cut, after, after]);
        let part = &sent[1][..keep.index(sent[1].len())];
        let (messages, counters) = decode([sent[0].as_slice(), part, &sent[2], &sent[3], &FLUSH]);
        prop_assert_eq!(messages, [before, after, after]);
        prop_assert_eq!(counters.lost, 1);
    }
}

/// Every change of every single byte: the frame is not taken for another, its neighbours arrive.
#[test]
fn a_corrupted_frame_is_dropped() {
    let state = State { position_m: Vector3::new(1.0, 2.0, 3.0), ..State::default() };
    let setpoint = Setpoint { position_m: Vector3::new(1.0, 2.0, 3.0), ..Setpoint::default() };
    let neighbour = Uplink::Command(Command::Disarm);
    for hit in [
        Uplink::Heartbeat,
        Uplink::Command(Command::Arm),
        Uplink::Setpoint(setpoint),
        Uplink::State { sent_us: 1, state },
    ] {
        let sent = frames(&[neighbour, hit, neighbour]);
        for place in 0..sent[1].len() {
            for change in 1..=255 {
                let mut corrupted = sent[1].clone();
                corrupted[place] ^= change;
                let (messages, counters) = decode([sent[0].as_slice(), &corrupted, &sent[2], &FLUSH]);
                assert_eq!(messages, [neighbour, neighbour], "{hit:?}: byte {place} changed by {change}");
                assert!(counters.skipped_bytes as usize >= corrupted.len());
            }
        }
    }
}

/// A frame with any payload and the right checksum.
fn raw(id: u32, flags: u8, payload: &[u8], extra_crc: u8) -> Vec<u8> {
    let mut frame = vec![0xFD, payload.len() as u8, flags, 0, 0, 255, 190];
    frame.extend_from_slice(&id.to_le_bytes()[..3]);
    frame.extend_from_slice(payload);
    let crc = mavlink::calculate_crc(&frame[1..], extra_crc);
    frame.extend_from_slice(&crc.to_le_bytes());
    frame
}

#[test]
fn each_cause_has_its_count() {
    let heartbeat = frames(&[Uplink::Heartbeat]).concat();
    let mut corrupted = heartbeat.clone();
    corrupted[12] ^= 1;
    let skipped = |frame: &[u8]| Counters { skipped_bytes: frame.len() as u32, ..Counters::default() };
    let oversized = raw(0, 0, &[1; 10], 50);
    let unknown = raw(30, 0, &[1; 28], 39);
    let signed = raw(0, 1, &[1; 9], 50);
    let malformed = raw(76, 0, &[0; 33], 152);
    let implausible = raw(331, 0, &[[0; 228].as_slice(), &[1, 12]].concat(), 91);
    let unsupported = raw(331, 0, &[0; 230], 91);
    let elsewhere = raw(84, 0, &[[0; 50].as_slice(), &[9, 1, 1]].concat(), 143);
    let cases = [
        (&heartbeat, Counters { received: 1, ..Counters::default() }),
        (&corrupted, Counters { bad_checksum: 1, ..skipped(&corrupted) }),
        (&oversized, Counters { oversized: 1, ..skipped(&oversized) }),
        (&unknown, Counters { unknown: 1, ..skipped(&unknown) }),
        (&signed, Counters { unsupported: 1, ..skipped(&signed) }),
        (&malformed, Counters { malformed: 1, ..Counters::default() }),
        (&implausible, Counters { implausible: 1, ..Counters::default() }),
        (&unsupported, Counters { unsupported: 1, ..Counters::default() }),
        (&elsewhere, Counters { elsewhere: 1, ..Counters::default() }),
    ];
    for (frame, expected) in cases {
        assert_eq!(decode([frame.as_slice()]).1, expected);
        // And the next frame is read.
        assert_eq!(decode([frame.as_slice(), &heartbeat]).0.last(), Some(&Uplink::Heartbeat));
    }
}

#[test]
fn gaps_between_sequence_numbers_are_counted() {
    let sent = frames(&[Uplink::Heartbeat; 300]);
    let lost = |order: &[usize]| decode(order.iter().map(|&i| sent[i].as_slice())).1.lost;
    assert_eq!(lost(&[0, 1, 2, 3]), 0);
    assert_eq!(lost(&[0, 2, 3, 7]), 4);
    assert_eq!(lost(&[254, 255, 256, 257]), 0);
    assert_eq!(lost(&[254, 257]), 2);
    assert_eq!(lost(&[5, 5, 6]), 0, "twice");
    assert_eq!(lost(&[5, 7, 6, 8]), 1, "out of order");

    let mut other = Sender::new(Address { system: 2, component: 1 });
    let foreign = other.send(&Uplink::Heartbeat, &mut [0; FRAME_MAX]).to_vec();
    assert_eq!(decode([sent[9].as_slice(), &foreign, &sent[10]]).1.lost, 0, "two senders");
}

#[test]
fn a_frame_inside_another_that_is_broken_is_found() {
    let state = Uplink::State { sent_us: 1, state: State::default() };
    let inner = frames(&[Uplink::Command(Command::Disarm)]).concat();
    let mut outer = frames(&[state]).concat();
    outer[100..100 + inner.len()].copy_from_slice(&inner);
    assert_eq!(decode([outer.as_slice()]).0, [Uplink::Command(Command::Disarm)]);
}

//! Decoding of a stream: fragments, noise, corruption, truncation, frames within frames.

use crate::reference;
use afbc_mavlink::{Address, Counters, Decoder, Downlink, Encoder, FRAME_MAX, MessageSet, Uplink, VehicleCommand};
use afbc_types::{Pose, PoseSigmas, Setpoint, State};
use mavlink::Message as _;
use mavlink::dialects::common::MavMessage;
use nalgebra::Vector3;
use proptest::prelude::*;
use reference::Frame;

const STATION: Address = Address { system: 255, component: 190 };
const VEHICLE: Address = Address { system: 1, component: 1 };

fn messages() -> impl Strategy<Value = Uplink> {
    let number = -100.0f32..100.0;
    prop_oneof![
        Just(Uplink::Heartbeat),
        Just(Uplink::Command(VehicleCommand::Arm)),
        Just(Uplink::Command(VehicleCommand::Disarm)),
        (any::<u64>(), number.clone()).prop_map(|(sent_us, x)| {
            let state = State { position_m: Vector3::new(x, 2.0 * x, 3.0 * x), ..State::default() };
            Uplink::State { sent_us, state, sigmas: PoseSigmas::UNKNOWN }
        }),
        (any::<u64>(), number.clone()).prop_map(|(sent_us, x)| {
            let sigmas = PoseSigmas { position_m: Some(1.0 + x.abs()), attitude_rad: Some(0.5) };
            let pose = Pose { position_m: Vector3::new(x, 2.0 * x, 3.0 * x), sigmas, ..Pose::default() };
            Uplink::Pose { sent_us, pose }
        }),
        number.prop_map(|x| Uplink::Setpoint(Setpoint { position_m: Vector3::new(x, -x, x), ..Setpoint::default() })),
    ]
}

/// Returns the frames of `messages` from one sender.
fn frames(messages: &[Uplink]) -> Vec<Vec<u8>> {
    let mut sender = Encoder::new(STATION);
    messages.iter().map(|message| sender.send(message, &mut [0; FRAME_MAX]).to_vec()).collect()
}

/// Decodes `chunks`; returns the messages and counts.
fn decode<'a>(chunks: impl IntoIterator<Item = &'a [u8]>) -> (Vec<Uplink>, Counters) {
    let mut decoder = Decoder::new(VEHICLE);
    let mut messages = Vec::new();
    for chunk in chunks {
        decoder.feed(chunk, |_, message| messages.push(message));
    }
    (messages, *decoder.counters())
}

/// Length of the longest frame, which is signed \[bytes\].
const LONGEST: usize = 280;

/// Zeros after which the decoder has decided about everything before them.
const FLUSH: [u8; LONGEST + 1] = [0; LONGEST + 1];

/// Returns the `CRC_EXTRA` of a message of the `common` dialect.
fn known_seed(id: u32) -> Option<u8> {
    // All messages that the `mavlink` crate knows; only COMPONENT_INFORMATION has the seed 0.
    Some(MavMessage::extra_crc(id)).filter(|&seed| seed != 0 || id == 395)
}

/// Returns the `CRC_EXTRA` of a message of the `common` dialect, or of an invented dialect.
fn seed(id: u32) -> u8 {
    known_seed(id).unwrap_or(99)
}

/// Returns the message in an unsigned frame, without fields that a newer dialect has appended.
fn message_in(id: u32, payload: &[u8]) -> Option<Uplink> {
    let known = match id {
        0 => 9,
        76 => 33,
        75 => 35,
        84 => 53,
        102 => 117,
        110 => 254,
        138 => 120,
        331 => 233,
        _ => return None,
    };
    Uplink::read(id, &payload[..payload.len().min(known)], VEHICLE).ok()
}

/// Returns the messages that must be delivered from `stream` by the specification and the decoder's rules.
fn expected(stream: &[u8]) -> Vec<Uplink> {
    let frames = reference::frames(stream, known_seed).into_iter();
    frames.filter(|frame| frame.flags == 0).filter_map(|frame| message_in(frame.id, &frame.payload)).collect()
}

/// Returns payloads of whole frames, parts of frames, start bytes and noise.
fn nesting_payloads() -> impl Strategy<Value = Vec<u8>> {
    let noise = prop::collection::vec(prop_oneof![3 => any::<u8>(), 1 => Just(0xFD), 1 => Just(0)], 0..40);
    let frame = messages().prop_map(|message| frames(&[message]).concat()).boxed();
    let part = (frame.clone(), any::<prop::sample::Index>()).prop_map(|(mut frame, at)| {
        frame.truncate(at.index(frame.len()));
        frame
    });
    let piece = prop_oneof![noise, frame, part];
    prop::collection::vec(piece, 0..6).prop_map(|pieces| {
        let mut payload = pieces.concat();
        payload.truncate(255);
        payload
    })
}

/// Returns a frame, and its message if it must be delivered. Includes messages that the direction carries; other
/// messages, from TUNNEL and LOG_DATA to unknown dialects, signed or not; carried messages that are signed or longer;
/// and all of these with damage after the header.
fn top_level() -> impl Strategy<Value = (Vec<u8>, Option<Uplink>)> {
    let carried = messages().prop_map(|message| (frames(&[message]).concat(), Some(message))).boxed();
    let id = prop_oneof![
        Just(385),
        Just(110),
        Just(120),
        Just(395),
        Just(0),
        Just(76),
        Just(75),
        Just(42_000),
        13_000_u32..1 << 24
    ];
    let flags = prop_oneof![2 => Just(0), 2 => Just(1), 1 => any::<u8>()];
    let other = (id, flags, nesting_payloads(), any::<u8>())
        .prop_map(|(id, flags, payload, sequence)| {
            // A carried message is delivered itself; nothing within it is.
            let message = if flags == 0 { message_in(id, &payload) } else { None };
            let frame = Frame { flags, sequence, system: 255, component: 190, id, payload };
            (frame.bytes(seed(id)), message)
        })
        .boxed();
    let damaged = prop_oneof![carried.clone(), other.clone()]
        .prop_flat_map(|(bytes, _)| {
            let summed = 10..usize::from(bytes[1]) + 12;
            (Just(bytes), summed, 1u8..)
        })
        .prop_map(|(mut bytes, place, change)| {
            bytes[place] ^= change;
            (bytes, None)
        });
    prop_oneof![2 => carried, 2 => other, 1 => damaged]
}

/// Returns any content of a line: frames of all kinds, whole or cut at either end, and noise.
fn streams() -> impl Strategy<Value = Vec<u8>> {
    let index = any::<prop::sample::Index>;
    let cut = (top_level(), index(), index()).prop_map(|((bytes, _), from, to)| {
        let (from, to) = (from.index(bytes.len()), to.index(bytes.len()));
        bytes[from.min(to)..from.max(to)].to_vec()
    });
    let piece = prop_oneof![4 => top_level().prop_map(|(bytes, _)| bytes), 1 => cut, 1 => nesting_payloads()];
    prop::collection::vec(piece, 0..12).prop_map(|pieces| pieces.concat())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    /// Arbitrary bytes cause no panic and no endless loop, and the counts are consistent.
    #[test]
    fn arbitrary_bytes_do_no_harm(bytes in prop::collection::vec(any::<u8>(), 0..2000)) {
        let (messages, counters) = decode([bytes.as_slice()]);
        prop_assert_eq!(messages.len(), counters.received as usize);
        prop_assert!(counters.skipped_bytes as usize <= bytes.len());
    }

    /// Bytes that often look like the start of a frame do no harm either.
    #[test]
    fn bytes_that_resemble_frames_do_no_harm(
        bytes in prop::collection::vec(
            prop_oneof![Just(0xFD), Just(0), Just(1), Just(84), Just(76), Just(75), any::<u8>()],
            0..2000,
        ),
    ) {
        let (messages, counters) = decode([bytes.as_slice()]);
        prop_assert_eq!(messages.len(), counters.received as usize);
    }

    /// The result does not depend on how the stream is split.
    #[test]
    fn the_division_of_the_stream_makes_no_difference(
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

    /// A frame after any noise arrives before 280 bytes have followed the noise.
    #[test]
    fn a_frame_behind_noise_arrives(noise in prop::collection::vec(any::<u8>(), 0..600), message in messages()) {
        let frame = frames(&[message]).concat();
        let (messages, counters) = decode([noise.as_slice(), &frame, &FLUSH[..LONGEST - frame.len()]]);
        prop_assert_eq!(messages, [message]);
        prop_assert!(counters.skipped_bytes as usize >= noise.len());
    }

    /// Noise, including truncated frames, costs no frame that begins at least 280 bytes after it. Nothing is delivered
    /// that was not sent.
    #[test]
    fn noise_costs_no_frame_beyond_its_reach(
        before in messages(),
        noise in streams(),
        cut in messages(),
        keep: prop::sample::Index,
        after in prop::collection::vec(messages(), 1..20),
    ) {
        let sent = frames(&[&[before, cut], after.as_slice()].concat());
        let part = &sent[1][..keep.index(sent[1].len())];
        for (noise, cut_only) in [(part, true), (&noise, false)] {
            // Excludes noise that the next frame's start byte completes to a valid frame.
            // `a_truncated_frame_may_be_completed_by_the_start_of_the_next` tests that case.
            let intact = |end: &[u8]| reference::frames(&[noise, end].concat(), known_seed).len();
            prop_assume!(intact(&[]) == intact(&[0xFD]));
            let stream = [sent[0].as_slice(), noise, &sent[2..].concat(), &FLUSH].concat();
            prop_assume!(!reference::any_by_chance(&stream, &[sent[0].len() + noise.len()], known_seed));
            let (messages, counters) = decode([stream.as_slice()]);
            let mut behind = 0;
            let within_reach = sent[2..].iter().take_while(|frame| {
                behind += frame.len();
                behind - frame.len() < LONGEST
            });
            let (near, far) = after.split_at(within_reach.count());
            prop_assert_eq!(messages[0], before);
            prop_assert!(messages.ends_with(far), "{} of {} and {}", messages.len(), near.len(), far.len());
            if cut_only {
                // The first bytes after the truncated frame may have completed it.
                let mut rest = [&[before, cut], after.as_slice()].concat().into_iter();
                prop_assert!(messages.iter().all(|message| rest.any(|sent| sent == *message)));
                prop_assert!(counters.lost as usize <= 1 + near.len());
            }
        }
    }

    /// In a stream of complete frames, exactly the carried ones are delivered, and nothing from within a frame.
    #[test]
    fn a_frame_within_a_frame_is_not_looked_at(top in prop::collection::vec(top_level(), 0..20)) {
        let last = frames(&[Uplink::Heartbeat]).concat();
        let stream = [top.iter().flat_map(|(bytes, _)| bytes.clone()).collect(), last, FLUSH.to_vec()].concat();
        let ends = top.iter().scan(0, |end, (bytes, _)| {
            *end += bytes.len();
            Some(*end)
        });
        prop_assume!(!reference::any_by_chance(&stream, &ends.collect::<Vec<_>>(), known_seed));
        let sent: Vec<_> = top.iter().filter_map(|(_, message)| *message).chain([Uplink::Heartbeat]).collect();
        prop_assert_eq!(&expected(&stream), &sent, "the reference");
        prop_assert_eq!(decode([stream.as_slice()]).0, sent);
    }

    /// A frame that cannot be verified does not delay the next frame, whatever the frame contains.
    #[test]
    fn a_foreign_frame_does_not_delay_the_next((stranger, _) in top_level(), message in messages()) {
        let frame = frames(&[message]).concat();
        prop_assert_eq!(decode([stranger.as_slice(), &frame]).0.last().copied(), Some(message));
    }

    /// The decoder delivers the same messages as the reference decoder, for any content of the line.
    #[test]
    fn the_reference_delivers_the_same(stream in streams()) {
        prop_assert_eq!(decode([stream.as_slice()]).0, expected(&stream));
    }
}

/// A random test found this case. A frame whose checksum ends in 0xFD loses its last byte, and the first byte of the
/// next frame completes it. The next frame then lacks its first byte.
#[test]
fn a_truncated_frame_may_be_completed_by_the_start_of_the_next() {
    let x = 33.915_356;
    let setpoint = Uplink::Setpoint(Setpoint { position_m: Vector3::new(x, -x, x), ..Setpoint::default() });
    let sent = frames(&[Uplink::Heartbeat, setpoint, Uplink::Heartbeat, Uplink::Heartbeat]);
    let (last, part) = sent[1].split_last().expect("a frame");
    assert_eq!(*last, 0xFD);
    let (messages, counters) = decode([sent[0].as_slice(), part, &sent[2], &sent[3], &FLUSH]);
    assert_eq!(messages, [Uplink::Heartbeat, setpoint, Uplink::Heartbeat]);
    assert_eq!(counters.lost, 1);
}

/// Found by `scripts/soak`: a 16-bit checksum is correct by chance once in 65,536 times. Here, bytes of the next frame
/// complete a truncated command to another valid frame, which is delivered.
#[test]
fn a_truncated_frame_may_become_another_by_chance() {
    let state =
        Uplink::State { sent_us: 14_286_421_826_361_620_939, state: State::default(), sigmas: PoseSigmas::UNKNOWN };
    let sent = frames(&[Uplink::Heartbeat, Uplink::Command(VehicleCommand::Disarm), state]);
    let part = (1..sent[1].len()).map(|length| &sent[1][..length]).find(|part| {
        let stream = [sent[0].as_slice(), part, &sent[2], &FLUSH].concat();
        reference::any_by_chance(&stream, &[sent[0].len() + part.len()], known_seed)
    });
    let (messages, _) = decode([sent[0].as_slice(), part.expect("one length of 43"), &sent[2], &FLUSH]);
    assert_eq!(messages.len(), 2);
    assert_ne!(messages[1], state);
}

/// After any change of a single byte, the frame is dropped and its neighbours arrive.
#[test]
fn a_corrupted_frame_is_dropped() {
    let state = State { position_m: Vector3::new(1.0, 2.0, 3.0), ..State::default() };
    let setpoint = Setpoint { position_m: Vector3::new(1.0, 2.0, 3.0), ..Setpoint::default() };
    let neighbour = Uplink::Command(VehicleCommand::Disarm);
    for hit in [
        Uplink::Heartbeat,
        Uplink::Command(VehicleCommand::Arm),
        Uplink::Setpoint(setpoint),
        Uplink::Pose { sent_us: 1, pose: Pose { position_m: Vector3::new(1.0, 2.0, 3.0), ..Pose::default() } },
        Uplink::State { sent_us: 1, state, sigmas: PoseSigmas::UNKNOWN },
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

/// Returns a frame with any payload and the correct checksum.
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
    let one = Counters { received: 1, ..Counters::default() };
    let skipped = |frame: &[u8]| Counters { skipped_bytes: frame.len() as u32, ..one };
    let not_carried = raw(30, 0, &[1; 28], 39);
    let foreign = raw(42_000, 0, &[1; 28], 39);
    let signed = [raw(0, 1, &[1; 9], 50), vec![7; 13]].concat();
    let flagged = raw(0, 2, &[1; 9], 50);
    let malformed = raw(331, 0, &[[0; 228].as_slice(), &[99, 12]].concat(), 91);
    let implausible = raw(331, 0, &[[0; 228].as_slice(), &[1, 12]].concat(), 91);
    let unsupported = raw(331, 0, &[0; 230], 91);
    let elsewhere = raw(84, 0, &[[0; 50].as_slice(), &[9, 1, 1]].concat(), 143);
    let cases = [
        (&heartbeat, Counters { received: 2, ..one }),
        (&corrupted, Counters { bad_checksum: 1, ..skipped(&corrupted) }),
        (&not_carried, Counters { unknown: 1, ..one }),
        (&foreign, Counters { unknown: 1, ..skipped(&foreign) }),
        (&signed, Counters { unsupported: 1, ..one }),
        (&flagged, Counters { unsupported: 1, ..one }),
        (&malformed, Counters { malformed: 1, ..one }),
        (&implausible, Counters { implausible: 1, ..one }),
        (&unsupported, Counters { unsupported: 1, ..one }),
        (&elsewhere, Counters { elsewhere: 1, ..one }),
    ];
    for (frame, expected) in cases {
        // The next frame is delivered as soon as it is complete.
        let (messages, counters) = decode([frame.as_slice(), &heartbeat]);
        assert_eq!((messages.last(), counters), (Some(&Uplink::Heartbeat), expected));
    }
}

/// A message with fields appended by a newer dialect is read without them. Tests every message of either direction, at
/// several lengths, signed and unsigned.
#[test]
fn fields_that_a_newer_dialect_appends_are_left_out() {
    fn one<M: MessageSet + core::fmt::Debug>(id: u32) {
        let Some(format) = M::format(id) else { return };
        for fill in [0_u8, 1, 63, 255] {
            let known = vec![fill; format.length_max];
            let read = |payload: &[u8]| {
                let mut decoder = Decoder::<M>::new(Address { system: fill, component: fill });
                let mut messages = Vec::new();
                for flags in [0, 1] {
                    let tail = if flags == 1 { vec![7; 13] } else { vec![] };
                    let frame = [raw(id, flags, payload, format.extra_crc), tail].concat();
                    decoder.feed_accepted(&frame, |_| true, |_, message| messages.push(format!("{message:?}")));
                }
                (messages, *decoder.counters())
            };
            let expected = read(&known);
            for more in [1, 4, 255 - format.length_max] {
                let longer = [known.clone(), vec![77; more.min(255 - format.length_max)]].concat();
                assert_eq!(read(&longer), expected, "{id} of {} bytes and {more}", known.len());
            }
        }
    }
    for id in 0..20_000 {
        one::<Uplink>(id);
        one::<Downlink>(id);
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

    let mut other = Encoder::new(Address { system: 2, component: 1 });
    let foreign = other.send(&Uplink::Heartbeat, &mut [0; FRAME_MAX]).to_vec();
    assert_eq!(decode([sent[9].as_slice(), &foreign, &sent[10]]).1.lost, 0, "two senders");
}

/// Nothing within a TUNNEL, FILE_TRANSFER_PROTOCOL or LOG_DATA for another system is delivered, not even a disarm
/// command, whatever follows. From a frame that is damaged or of an unknown dialect, nothing is delivered if a frame
/// follows.
#[test]
fn a_frame_that_carries_another_is_skipped_whole() {
    let disarm = frames(&[Uplink::Command(VehicleCommand::Disarm)]).concat();
    let next = frames(&[Uplink::Heartbeat]).concat();
    for flags in [0, 1] {
        for id in [385, 110, 120, 30, 42_000, 0xFF_FFFF] {
            for before in 0..40 {
                let payload = [vec![0xFD; before], disarm.clone(), vec![0; 30]].concat();
                let frame = Frame { flags, sequence: 9, system: 7, component: 7, id, payload };
                let known = id < 400;
                let outer = frame.bytes(seed(id));
                let mut damaged = outer.clone();
                damaged[10 + before + disarm.len() + 3] ^= 1;
                for (outer, right) in [(&outer, known), (&damaged, false)] {
                    assert_eq!(decode([outer.as_slice(), &next]).0, [Uplink::Heartbeat], "{id}, {flags}, {before}");
                    assert_eq!(decode([outer.as_slice()]).0, [], "{id}, {flags}, {before}");
                    let found = if right { vec![] } else { vec![Uplink::Command(VehicleCommand::Disarm)] };
                    assert_eq!(decode([outer.as_slice(), &FLUSH]).0, found, "{id}, {flags}, {before}");
                }
            }
        }
    }
}

/// Messages that this direction does not carry cost no frame and no delay, and do not count as lost.
#[test]
fn a_stream_with_foreign_frames_loses_no_message() {
    let mut decoder = Decoder::new(VEHICLE);
    let ours = Uplink::Setpoint(Setpoint::default());
    for round in 0..=u8::MAX {
        for (sequence, id) in [(0, 66), (1, 21), (2, 110), (4, 42_000)] {
            let sequence = round.wrapping_mul(5).wrapping_add(sequence);
            // Start bytes that announce frames beyond the end of this frame.
            let payload = [[0xFD, 5].repeat(20), vec![round; 100]].concat();
            let stranger = Frame { flags: 0, sequence, system: 255, component: 190, id, payload };
            decoder.feed(&stranger.bytes(seed(id)), |_, message: Uplink| panic!("{message:?}"));
            if id == 110 {
                let (id, payload) = (84, frames(&[ours])[0][10..].to_vec());
                let payload = payload[..payload.len() - 2].to_vec();
                let frame = Frame { sequence: sequence.wrapping_add(1), id, payload, ..stranger };
                let mut delivered = None;
                decoder.feed(&frame.bytes(143), |_, message| delivered = Some(message));
                assert_eq!(delivered, Some(ours));
            }
        }
    }
    // Messages of another dialect cannot be verified and count as lost.
    assert_eq!(decoder.counters().lost, 255);
}

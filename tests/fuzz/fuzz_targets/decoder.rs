//! The link's decoders on arbitrary bytes, whole and in pieces: they do not panic, both ways deliver the same messages,
//! every byte is counted, delivered messages are read back from their own frames, and no payload gives an implausible
//! state. For arbitrary bytes and for frames within frames, they deliver the same as an independent reference.
#![no_main]

#[path = "../../../crates/mavlink/tests/reference/mod.rs"]
mod reference;

use afbc_mavlink::{Address, Counters, Decoder, Downlink, Encoder, FRAME_MAX, MessageSet, Uplink};
use libfuzzer_sys::fuzz_target;
use mavlink::Message as _;
use mavlink::dialects::common::MavMessage;

const VEHICLE: Address = Address { system: 1, component: 1 };

fn decode<'a, M: MessageSet>(pieces: impl Iterator<Item = &'a [u8]>) -> (Vec<M>, Counters) {
    let mut decoder = Decoder::new(VEHICLE);
    let mut messages = Vec::new();
    pieces.for_each(|piece| decoder.feed(piece, |_, message| messages.push(message)));
    (messages, *decoder.counters())
}

fn check<M: MessageSet + core::fmt::Debug>(bytes: &[u8]) {
    let (messages, counters) = decode::<M>(core::iter::once(bytes));
    // The messages are compared as text, since a NaN in telemetry is not equal to itself.
    let whole = format!("{messages:?}");
    assert_eq!((whole, counters), {
        let (messages, counters) = decode::<M>(bytes.chunks(1));
        (format!("{messages:?}"), counters)
    });
    assert_eq!(messages.len(), counters.received as usize);
    assert!(counters.skipped_bytes as usize <= bytes.len());
    for message in &messages {
        let mut buffer = [0; FRAME_MAX];
        let (again, _) = decode::<M>(core::iter::once(Encoder::new(VEHICLE).send(message, &mut buffer)));
        assert_eq!(again.len(), 1, "{message:?}");
    }
}

/// The `CRC_EXTRA` of a message of the `common` dialect; COMPONENT_INFORMATION's is 0.
fn seed(id: u32) -> Option<u8> {
    Some(MavMessage::extra_crc(id)).filter(|&seed| seed != 0 || id == 395)
}

/// Checks that the decoder delivers the same as the reference.
fn check_against_reference(stream: &[u8]) {
    let frames = reference::frames(stream, seed).into_iter();
    let expected: Vec<_> = frames
        .filter(|frame| frame.flags == 0)
        .filter(|frame| Uplink::format(frame.id).is_some_and(|format| frame.payload.len() <= format.length_max))
        .filter_map(|frame| Uplink::read(frame.id, &frame.payload, VEHICLE).ok())
        .collect();
    assert_eq!(decode::<Uplink>(core::iter::once(stream)).0, expected);
}

/// Returns a stream of frames with correct checksums. `bytes` gives each frame's kind, flags, length, use and payload.
/// A frame is sent, sent without its last byte, or becomes the beginning of the next frame's payload.
fn nested(mut bytes: &[u8]) -> Vec<u8> {
    const IDS: [u32; 12] = [0, 76, 84, 102, 138, 331, 385, 110, 120, 395, 42_000, 0xFF_FFFF];
    let (mut stream, mut carried) = (Vec::new(), Vec::new());
    while let [kind, flags, length, purpose, rest @ ..] = bytes {
        let (payload, rest) = rest.split_at(usize::from(*length).min(rest.len()));
        bytes = rest;
        carried.extend_from_slice(payload);
        carried.truncate(255);
        let (id, payload) = (IDS[usize::from(*kind) % IDS.len()], core::mem::take(&mut carried));
        let frame = reference::Frame { flags: *flags, sequence: *kind, system: 255, component: 190, id, payload };
        let frame = frame.bytes(seed(id).unwrap_or(99));
        match purpose % 4 {
            0 | 1 => stream.extend(frame),
            2 => stream.extend_from_slice(&frame[..frame.len() - 1]),
            _ => carried = frame,
        }
    }
    stream
}

/// Checks that any payload that arrives intact gives a message that is safe to fly on.
fn check_payload<M: MessageSet>(payload: &[u8], flyable: impl Fn(&M) -> bool) {
    for id in 0..400 {
        if let Ok(message) = M::read(id, payload, VEHICLE) {
            assert!(flyable(&message));
        }
    }
}

fuzz_target!(|bytes: &[u8]| {
    check::<Uplink>(bytes);
    check::<Downlink>(bytes);
    check_against_reference(bytes);
    check_against_reference(&nested(bytes));
    let payload = &bytes[..bytes.len().min(255)];
    check_payload(payload, |message: &Uplink| match message {
        Uplink::State { state, .. } => state.is_plausible(),
        Uplink::Pose { pose, .. } => pose.is_plausible(),
        Uplink::Setpoint(setpoint) => setpoint.is_plausible(),
        _ => true,
    });
    check_payload(payload, |_: &Downlink| true);
});

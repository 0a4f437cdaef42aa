//! Signatures match those of MAVLink's reference implementation (`reference/signed.py`), and any changed bit is
//! detected.

use afbc_mavlink::{Address, Decoder, Downlink, Encoder, MessageSet, SIGNED_FRAME_MAX, SigningKey, Stamp, Uplink};
use proptest::prelude::*;

const STATION: Address = Address { system: 255, component: 190 };
const VEHICLE: Address = Address { system: 1, component: 1 };

struct Signed {
    name: &'static str,
    key: SigningKey,
    time_10us: u64,
    bytes: Vec<u8>,
}

fn bytes(hex: &str) -> Vec<u8> {
    (0..hex.len()).step_by(2).map(|at| u8::from_str_radix(&hex[at..at + 2], 16).expect("hex")).collect()
}

fn signed() -> Vec<Signed> {
    let lines = include_str!("reference/signed.txt").lines().map(|line| line.split(' ').collect::<Vec<_>>());
    let read = |fields: Vec<&'static str>| Signed {
        name: fields[0],
        key: SigningKey(bytes(fields[1]).try_into().expect("32 bytes")),
        time_10us: fields[2].parse().expect("a number"),
        bytes: bytes(fields[3]),
    };
    lines.map(read).collect()
}

/// Decodes with this key; returns link ids, timestamps and messages.
fn decode<M: MessageSet>(frame: &[u8], key: SigningKey) -> Vec<(Stamp, M)> {
    let (mut stamps, mut messages) = (Vec::new(), Vec::new());
    let accept = |frame: &afbc_mavlink::ReceivedFrame<'_>| {
        let genuine = frame.is_signed_by(&key);
        stamps.extend(frame.stamp().filter(|_| genuine));
        genuine
    };
    Decoder::<M>::new(VEHICLE).feed_accepted(frame, accept, |from, message| {
        assert_eq!(from, STATION);
        messages.push(message);
    });
    stamps.into_iter().zip(messages).collect()
}

fn check<M: MessageSet + core::fmt::Debug>(signed: &Signed) {
    let Signed { name, key, time_10us, bytes } = signed;
    let heard = decode::<M>(bytes, *key);
    let [(stamp, message)] = &heard[..] else { panic!("{name}: {heard:?}") };
    assert_eq!(stamp.time_10us, *time_10us, "{name}");
    // A key that differs in one bit is refused.
    let mut other = *key;
    other.0[31] ^= 1;
    assert!(decode::<M>(bytes, other).is_empty(), "{name}");
    // Without a key, nothing is delivered from the frame.
    Decoder::<M>::new(VEHICLE).feed(bytes, |_, message| panic!("{name}: {message:?}"));
    // Signing the message again gives the same frame, except for messages that this crate writes with other fields.
    if !matches!(*name, "HEARTBEAT" | "SET_MODE" | "SETUP_SIGNING") {
        let mut buffer = [0; SIGNED_FRAME_MAX];
        assert_eq!(Encoder::new(STATION).send_signed(message, Some((key, *stamp)), &mut buffer), bytes, "{name}");
    }
}

#[test]
fn the_reference_implementation_signs_the_same() {
    let all = signed();
    assert_eq!(all.len(), 5);
    for signed in &all {
        if signed.name.starts_with('<') { check::<Downlink>(signed) } else { check::<Uplink>(signed) }
    }
}

#[test]
fn a_key_that_is_all_zero_is_none() {
    let setup = afbc_mavlink::SetupSigning { key: None, time_10us: 77 };
    let mut buffer = [0; afbc_mavlink::FRAME_MAX];
    let frame = Encoder::new(STATION).send(&Uplink::Signing(setup), &mut buffer).to_vec();
    let mut heard = Vec::new();
    Decoder::new(VEHICLE).feed(&frame, |_, message: Uplink| heard.push(message));
    assert_eq!(heard, [Uplink::Signing(setup)]);
}

proptest! {
    /// Any changed bit in a signed frame, its signature or its key is detected.
    #[test]
    fn a_changed_bit_is_found(
        key in any::<[u8; 32]>(),
        link in any::<u8>(),
        time_10us in 0..=afbc_mavlink::TIME_MAX,
        bit in any::<prop::sample::Index>(),
    ) {
        let (key, stamp) = (SigningKey(key), Stamp { link, time_10us });
        let mut buffer = [0; SIGNED_FRAME_MAX];
        let signature = Some((&key, stamp));
        let mut frame = Encoder::new(STATION).send_signed(&Uplink::Heartbeat, signature, &mut buffer).to_vec();
        prop_assert_eq!(decode(&frame, key), [(stamp, Uplink::Heartbeat)]);
        let bit = bit.index(8 * (frame.len() + 32));
        let mut other = key;
        match frame.get_mut(bit / 8) {
            Some(byte) => *byte ^= 1 << (bit % 8),
            None => other.0[bit / 8 - frame.len()] ^= 1 << (bit % 8),
        }
        prop_assert!(decode::<Uplink>(&frame, other).is_empty());
    }
}

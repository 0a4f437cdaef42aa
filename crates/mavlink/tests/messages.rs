//! For every message of both directions: a payload that can be read can also be written with the same content.

use afbc_mavlink::{Address, Decoder, Downlink, Encoder, FRAME_MAX, MessageSet, Transfer, Uplink, VehicleCommand};
use core::fmt::Debug;
use proptest::prelude::*;

const VEHICLE: Address = Address { system: 1, component: 1 };

/// Returns the ids of all messages of a direction.
fn ids<M: MessageSet>() -> Vec<u32> {
    (0..20_000).filter(|id| M::format(*id).is_some()).collect()
}

/// Returns bytes that often contain floating-point numbers of moderate size, or small integers.
fn payloads() -> impl Strategy<Value = Vec<u8>> {
    let word = prop_oneof![
        any::<u32>().prop_map(u32::to_le_bytes),
        (-1e3..1e3f32).prop_map(f32::to_le_bytes),
        prop::sample::select([0.0, 1.0, -1.0, f32::NAN, f32::INFINITY].as_slice()).prop_map(f32::to_le_bytes),
        (0..12u32).prop_map(u32::to_le_bytes),
        prop::array::uniform4(0..4u8),
    ];
    (prop::collection::vec(word, 0..64), 0..4usize).prop_map(|(words, cut)| {
        let mut bytes = words.concat();
        bytes.truncate(bytes.len().saturating_sub(cut).min(255));
        bytes
    })
}

/// Reads this payload as each message of a direction and writes each result again; returns the number of readable ones.
fn check<M: MessageSet + Debug>(payload: &[u8]) -> usize {
    let understood = ids::<M>().into_iter().filter_map(|id| {
        let length = M::format(id).expect("known").length_max;
        M::read(id, &payload[..payload.len().min(length)], VEHICLE).ok()
    });
    understood
        .map(|message| {
            let mut buffer = [0; FRAME_MAX];
            let bytes = Encoder::new(VEHICLE).send(&message, &mut buffer);
            let mut again = Vec::new();
            Decoder::<M>::new(VEHICLE).feed(bytes, |_, message| again.push(message));
            // Compares as text, since NaN differs from itself.
            assert_eq!(format!("{again:?}"), format!("{:?}", [&message]));
        })
        .count()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    #[test]
    fn what_is_understood_can_be_sent_on(payload in payloads()) {
        check::<Uplink>(&payload);
        prop_assert!(check::<Downlink>(&payload) > 10, "telemetry has no invalid numbers");
    }

    /// For any parameters, a command stays the same when it is written and read again, also if denied or unknown.
    #[test]
    fn commands_survive(
        numbers in prop::array::uniform7(prop_oneof![
            prop::sample::select([0.0, 1.0, 2.0, 4.0, -1.0, 21196.0, f32::NAN, f32::INFINITY].as_slice()),
            -100.0..1000.0f32,
        ]),
        id in prop_oneof![8 => prop::sample::select(VehicleCommand::KNOWN.as_slice()), 1 => any::<u16>()],
        frame in 0..8u8,
    ) {
        let mut payload: Vec<u8> = numbers.into_iter().flat_map(f32::to_le_bytes).collect();
        payload.extend(id.to_le_bytes());
        payload.extend([1, 1, frame]);
        prop_assert!(check::<Uplink>(&payload) > 5, "commands are always understood");
        for message in [76, 75] {
            let read = Uplink::read(message, &payload, VEHICLE);
            let Ok(Uplink::Command(command)) = read else { return Err(TestCaseError::fail(format!("{read:?}"))) };
            prop_assert_eq!(command.id(), id);
            prop_assert_eq!(matches!(command, VehicleCommand::Other(_)), !VehicleCommand::KNOWN.contains(&id));
        }
    }
}

/// Each direction carries exactly the messages that docs/reference/mavlink.md lists; change both together.
#[test]
fn the_messages_are_these() {
    assert_eq!(
        ids::<Uplink>(),
        [
            0, 2, 4, 5, 11, 20, 21, 23, 37, 38, 39, 40, 41, 42, 43, 44, 45, 46, 47, 48, 51, 66, 69, 70, 73, 75, 76, 82,
            84, 86, 102, 110, 111, 117, 119, 121, 122, 123, 126, 135, 138, 144, 233, 243, 256, 258, 268, 320, 321, 323,
            331, 400, 412
        ]
    );
    assert_eq!(
        ids::<Downlink>(),
        [
            0, 1, 2, 4, 6, 22, 24, 30, 31, 32, 33, 37, 38, 39, 40, 41, 42, 43, 44, 45, 46, 47, 49, 51, 65, 67, 73, 74,
            77, 85, 93, 110, 111, 118, 120, 126, 136, 147, 148, 230, 242, 244, 245, 253, 290, 291, 300, 322, 324, 345,
            350, 360, 375, 413, 435, 436
        ]
    );
    assert_eq!(ids::<Transfer>(), [110, 118, 120, 266, 267, 395, 397]);
}

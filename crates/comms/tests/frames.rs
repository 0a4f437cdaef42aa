//! Sends random frames of several stations, some damaged or nested, through the whole link. Nothing panics, every
//! command is answered exactly once to its sender, and no station does what it may not. `scripts/soak` uses other
//! seeds.

use crate::common::{Bench, STATION};
use afbc_comms::services::control::is_needed_for;
use afbc_flight_core::Request;
use afbc_guidance::Orders;
use afbc_mavlink::{
    Address, CommandResult, Downlink, Encoder, FRAME_MAX, MessageSet, MissionMessage, MissionType, Reboot, Uplink,
    VehicleCommand,
};
use afbc_types::State;
use proptest::prelude::*;
use std::collections::BTreeMap;

const STATIONS: [Address; 3] = [STATION, Address { system: 245, component: 190 }, Address { system: 42, component: 1 }];
const VEHICLE: Address = Address { system: 1, component: 1 };
/// All messages that the vehicle reads, and TUNNEL and FILE_TRANSFER_PROTOCOL, which may contain others.
const IDS: [u32; 31] = [
    0, 2, 4, 5, 11, 20, 21, 23, 40, 41, 43, 44, 45, 47, 51, 66, 69, 73, 75, 76, 82, 84, 86, 102, 111, 138, 331, 42, 46,
    110, 385,
];
/// Checksum seeds of FILE_TRANSFER_PROTOCOL and TUNNEL.
const CARRIERS: [(u32, u8); 2] = [(110, 84), (385, 147)];

/// CRC-16/MCRF4XX.
fn crc(bytes: &[u8], extra: u8) -> u16 {
    bytes.iter().chain([&extra]).fold(0xFFFF, |crc, byte| {
        (0..8).fold(crc ^ u16::from(*byte), |crc, _| if crc & 1 == 1 { (crc >> 1) ^ 0x8408 } else { crc >> 1 })
    })
}

fn frame(from: Address, id: u32, payload: &[u8]) -> Vec<u8> {
    let carrier = CARRIERS.iter().find(|(other, _)| *other == id).map(|(_, seed)| *seed);
    let seed = carrier.or_else(|| Uplink::format(id).map(|format| format.extra_crc)).expect("known");
    let [a, b, c, _] = id.to_le_bytes();
    let mut frame = vec![0xFD, payload.len() as u8, 0, 0, 0, from.system, from.component, a, b, c];
    frame.extend_from_slice(payload);
    let sum = crc(&frame[1..], seed);
    frame.extend_from_slice(&sum.to_le_bytes());
    frame
}

/// A frame of a station.
#[derive(Clone, Debug)]
struct Sent {
    from: Address,
    id: u32,
    payload: Vec<u8>,
}

/// Numbers that have a meaning in a command.
const USUAL: [f32; 10] = [0.0, 1.0, 2.0, 3.0, 4.0, 6.0, -1.0, 21196.0, f32::NAN, f32::INFINITY];

fn numbers() -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => prop::sample::select(USUAL.as_slice()),
        1 => any::<f32>(),
        1 => (0..500u32).prop_map(|message| message as f32),
    ]
}

/// Generates commands, most of them with a known number.
fn commands() -> impl Strategy<Value = (u32, Vec<u8>)> {
    let id = prop_oneof![4 => prop::sample::select(VehicleCommand::KNOWN.as_slice()), 1 => any::<u16>()];
    let to = prop::sample::select([[1u8, 1], [1, 0], [0, 0], [2, 1]].as_slice());
    (prop::array::uniform7(numbers()), id, to, any::<bool>(), 0..8u8).prop_map(|(numbers, id, to, long, frame)| {
        let mut payload: Vec<u8> = numbers.into_iter().flat_map(f32::to_le_bytes).collect();
        payload.extend(id.to_le_bytes());
        payload.extend(to);
        payload.push(frame);
        (if long { 76 } else { 75 }, payload)
    })
}

fn sent() -> impl Strategy<Value = Sent> {
    let any_message = (prop::sample::select(IDS.as_slice()), prop::collection::vec(any::<u8>(), 0..60));
    let content = prop_oneof![1 => commands(), 1 => any_message];
    (prop::sample::select(STATIONS.as_slice()), content).prop_map(|(from, (id, payload))| Sent { from, id, payload })
}

/// Returns the command in a frame, if it is for the vehicle.
fn command(sent: &Sent) -> Option<VehicleCommand> {
    // Only the known part of a longer payload is read.
    let known = sent.payload.len().min(Uplink::format(sent.id)?.length_max);
    match Uplink::read(sent.id, &sent.payload[..known], VEHICLE) {
        Ok(Uplink::Command(command)) => Some(command),
        _ => None,
    }
}

/// Number of answers for each command and station.
type Counts = BTreeMap<(u16, u8, u8), usize>;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    /// The frames arrive undamaged.
    #[test]
    fn every_command_is_answered_once(ticks in prop::collection::vec(prop::collection::vec(sent(), 0..4), 1..60)) {
        let mut bench = Bench::new();
        let (mut due, mut reported, mut unanswered) = (Counts::new(), Counts::new(), 0);
        let mut count = |said: &[Downlink]| {
            for message in said {
                match *message {
                    // "In progress" is not the final answer.
                    Downlink::CommandAck { answer: CommandResult::InProgress, .. } => (),
                    Downlink::CommandAck { command, to, .. } => {
                        *reported.entry((command, to.system, to.component)).or_default() += 1;
                    }
                    Downlink::Health(health) => unanswered = health.unanswered,
                    _ => (),
                }
            }
        };
        for sent in &ticks {
            for sent in sent {
                bench.hear_bytes(&frame(sent.from, sent.id, &sent.payload));
                if let Some(command) = command(sent) {
                    *due.entry((command.id(), sent.from.system, sent.from.component)).or_default() += 1;
                }
            }
            count(&bench.step().1);
        }
        (0..400).for_each(|_| count(&bench.step().1));
        prop_assert_eq!(unanswered, 0);
        prop_assert_eq!(reported, due);
    }

    /// Damaged, truncated and nested frames cause no panic, and the vehicle's messages can be decoded ([`Bench::said`]
    /// checks this).
    #[test]
    fn nothing_makes_it_panic(
        frames in prop::collection::vec((sent(), any::<u8>(), any::<u16>()), 1..120),
        flying: bool,
    ) {
        let mut bench = if flying { Bench::flying() } else { Bench::new() };
        for (sent, fate, place) in frames {
            let whole = frame(sent.from, sent.id, &sent.payload);
            let at = usize::from(place) % whole.len();
            let bytes = match fate % 8 {
                0 => whole[..at].to_vec(),
                1 => {
                    let mut damaged = whole;
                    damaged[at] ^= fate | 1;
                    damaged
                }
                2 => frame(sent.from, if fate & 8 == 0 { 110 } else { 385 }, &whole[..whole.len().min(200)]),
                3 => [whole.as_slice(), &[fate; 3]].concat(),
                _ => whole,
            };
            bench.hear_bytes(&bytes);
            if flying {
                bench.measure(&State::default());
            }
            bench.step();
        }
    }

    /// While one station is in control, another one can only get answers, set rates and stop the motors.
    #[test]
    fn a_station_that_is_not_in_control_changes_nothing(frames in prop::collection::vec(sent(), 1..80)) {
        let mut bench = Bench::new();
        let say = |bench: &mut Bench, from, message| {
            bench.receive(Encoder::new(from).send(&message, &mut [0; FRAME_MAX]))
        };
        say(&mut bench, STATION, Uplink::Command(VehicleCommand::Land));
        bench.step();
        for sent in frames {
            // States and poses of a tracker are no commands.
            if sent.from == STATION || [102, 138, 331].contains(&sent.id) {
                continue;
            }
            let update = bench.receive(&frame(sent.from, sent.id, &sent.payload));
            prop_assert_eq!(update.orders, Orders::default(), "{:?}", sent);
            prop_assert_eq!(update.inbox.setpoint(), None);
            if let Some(asked) = update.inbox.asked() {
                prop_assert!(matches!(asked.value, Request::Disarm | Request::Kill), "{:?}", sent);
            }
            prop_assert!(bench.comms.wants_reboot().is_none());
            bench.step();
        }
    }
}

/// docs/security.md lists the commands that need no control. They change nothing but the messages that are sent.
#[test]
fn commands_that_do_not_need_control() {
    let free = [
        VehicleCommand::Disarm,
        VehicleCommand::Kill,
        VehicleCommand::SetInterval { message: 30, interval_us: 0 },
        VehicleCommand::GetInterval(30),
        VehicleCommand::RequestMessage { message: 30, index: 0 },
        VehicleCommand::RequestProtocol,
        VehicleCommand::RequestCapabilities,
        VehicleCommand::CheckArming,
        VehicleCommand::StartLogStream,
        VehicleCommand::StopLogStream,
        VehicleCommand::Denied(400),
        VehicleCommand::Other(1),
    ];
    assert!(free.into_iter().all(|command| !is_needed_for(command)));
    let bound = [
        VehicleCommand::Arm,
        VehicleCommand::Engage,
        VehicleCommand::SelfTest,
        VehicleCommand::Land,
        VehicleCommand::Reboot(Reboot::BootLoader),
    ];
    assert!(bound.into_iter().all(is_needed_for));
    let page = include_str!("../../../docs/security.md");
    for word in ["disarm", "kill", "message", "interval"] {
        assert!(page.contains(word), "{word}");
    }
}

/// Control passes to a second station when the first station releases it. Until then the second is informed once.
#[test]
fn a_second_station_is_informed_once_and_follows() {
    let mut bench = Bench::new();
    let [first, second, _] = STATIONS;
    let heard = |bench: &mut Bench| {
        let (mut answers, mut texts) = (Vec::new(), Vec::new());
        for message in (0..5).flat_map(|_| bench.step().1) {
            match message {
                Downlink::CommandAck { answer, to, .. } => answers.push((answer, to)),
                Downlink::Text { text, .. } => texts.push(text.to_str().expect("text").to_owned()),
                _ => (),
            }
        }
        (answers, texts)
    };
    bench.hear_from(first, Uplink::Command(VehicleCommand::SetCurrent(Some(7), false)));
    heard(&mut bench);
    for times in 0..2 {
        bench.hear_from(second, Uplink::Command(VehicleCommand::Arm));
        let (answers, texts) = heard(&mut bench);
        assert_eq!(answers, [(CommandResult::Refused(afbc_comms::NOT_IN_CONTROL), second)]);
        assert_eq!(texts.iter().filter(|text| *text == "245/190 ignored: 255/190 is in control").count(), 1 - times);
    }
    bench.hear_from(first, Uplink::Control(afbc_mavlink::ControlRequest::Release));
    bench.hear_from(second, Uplink::Command(VehicleCommand::Arm));
    let (answers, _) = heard(&mut bench);
    assert!(!answers.contains(&(CommandResult::Refused(afbc_comms::NOT_IN_CONTROL), second)), "{answers:?}");
    // A station that is not in control cannot clear the mission.
    bench.hear_from(first, Uplink::Mission(MissionMessage::Clear(MissionType::ALL)));
    let said: Vec<_> = (0..5).flat_map(|_| bench.step().1).collect();
    let denied = |message: &Downlink| {
        let Downlink::Mission { message, to } = message else { return false };
        matches!(message, MissionMessage::Ack(..)) && *to == first
    };
    assert!(said.iter().any(denied));
}

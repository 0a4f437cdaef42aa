//! Every message of MAVLink's common dialect that expects an answer gets one, even on a full and slow line. No other
//! message is answered.

use crate::common;
use crate::dialect::{Expected, expected};
use afbc_comms::services::origin::{EarthOrigin, Global};
use afbc_comms::services::streams::{DEFAULTS, id};
use afbc_comms::{AuxSensors, Comms, Setup};
use afbc_mavlink::{Address, Uplink, VehicleCommand};
use afbc_onboard::{Configuration, Link, Readings, parameters::ParameterTable};
use afbc_types::State;
use common::{Bench, STATION};
use mavlink::dialects::common::*;
use mavlink::{MavlinkVersion, Message as _, MessageData};
use std::collections::BTreeSet;

const OTHER: Address = Address { system: 245, component: 191 };
const VEHICLE: Address = Address { system: 1, component: 1 };
/// Longest time until an answer is sent \[ticks\].
const WITHIN: usize = 250;

/// A message as it is sent.
#[derive(Clone, Debug)]
struct Sample {
    id: u32,
    payload: Vec<u8>,
}

/// Builds a message with these bytes of extension fields.
fn extended<D: MessageData>(data: &D, extension: &[u8]) -> Sample {
    let mut payload = vec![0; 255];
    data.ser(MavlinkVersion::V2, &mut payload);
    payload.truncate(D::ENCODED_LEN);
    payload.extend_from_slice(extension);
    Sample { id: D::ID, payload }
}

/// Builds a message to the vehicle, with the target at this offset.
fn at<D: MessageData>(data: &D, system: usize, extension: &[u8]) -> Sample {
    let mut sample = extended(data, extension);
    sample.payload[system..system + 2].copy_from_slice(&[VEHICLE.system, VEHICLE.component]);
    sample
}

/// Returns the requests of the dialect in all varieties, addressed to the vehicle. The offsets of the targets follow
/// MAVLink's field order.
fn requests() -> Vec<Sample> {
    let name = |text: &str| {
        let mut bytes = [0; 16];
        bytes[..text.len()].copy_from_slice(text.as_bytes());
        bytes
    };
    let mut samples = vec![
        extended(&PING_DATA { time_usec: 7, seq: 3, ..PING_DATA::DEFAULT }, &[]),
        extended(&TIMESYNC_DATA { tc1: 0, ts1: 77 }, &[1, 1]),
        extended(&TIMESYNC_DATA { tc1: 0, ts1: 77 }, &[]),
        extended(&SET_MODE_DATA { target_system: 1, ..SET_MODE_DATA::DEFAULT }, &[]),
        extended(&SET_HOME_POSITION_DATA { target_system: 1, ..SET_HOME_POSITION_DATA::DEFAULT }, &[]),
        extended(&SET_GPS_GLOBAL_ORIGIN_DATA { target_system: 1, ..SET_GPS_GLOBAL_ORIGIN_DATA::DEFAULT }, &[]),
        at(&PARAM_REQUEST_LIST_DATA::DEFAULT, 0, &[]),
        at(&PARAM_EXT_REQUEST_LIST_DATA::DEFAULT, 0, &[]),
        at(&LOG_REQUEST_LIST_DATA { start: 0, end: 0xFFFF, ..LOG_REQUEST_LIST_DATA::DEFAULT }, 4, &[]),
        at(&LOG_REQUEST_DATA_DATA { ofs: 90, count: 900, id: 5, ..LOG_REQUEST_DATA_DATA::DEFAULT }, 10, &[]),
        at(&REQUEST_EVENT_DATA { first_sequence: 5, last_sequence: 9, ..REQUEST_EVENT_DATA::DEFAULT }, 4, &[]),
        extended(
            &SERIAL_CONTROL_DATA {
                flags: SerialControlFlag::SERIAL_CONTROL_FLAG_RESPOND,
                device: SerialControlDev::SERIAL_CONTROL_DEV_SHELL,
                ..SERIAL_CONTROL_DATA::DEFAULT
            },
            &[1, 1],
        ),
        extended(&TERRAIN_CHECK_DATA { lat: 470_000_000, lon: 80_000_000 }, &[]),
        at(&MISSION_SET_CURRENT_DATA::DEFAULT, 2, &[]),
        at(&MISSION_SET_CURRENT_DATA { seq: 7, ..MISSION_SET_CURRENT_DATA::DEFAULT }, 2, &[]),
    ];
    for control in [0, 1] {
        let data = CHANGE_OPERATOR_CONTROL_DATA { target_system: 1, control_request: control, ..Default::default() };
        samples.push(extended(&data, &[]));
    }
    // Parameters that exist and that do not, by name and by index.
    for (place, text) in [(-1, "V_MASS"), (-1, "NO_SUCH_NAME"), (0, ""), (9_999, ""), (-7, ""), (i16::MAX, "V_MASS")] {
        let param_id = name(text).into();
        samples.push(at(&PARAM_REQUEST_READ_DATA { param_index: place, param_id, ..Default::default() }, 2, &[]));
        samples.push(at(&PARAM_EXT_REQUEST_READ_DATA { param_index: place, param_id, ..Default::default() }, 2, &[]));
    }
    for (text, value) in [("V_MASS", 0.5), ("V_MASS", f32::NAN), ("V_MASS", 1e9), ("NO_SUCH_NAME", 1.0), ("", 0.0)] {
        let param_id = name(text).into();
        samples.push(at(&PARAM_SET_DATA { param_value: value, param_id, ..Default::default() }, 4, &[]));
        samples.push(at(&PARAM_EXT_SET_DATA { param_id, ..Default::default() }, 0, &[]));
    }
    // The types of plan are missions, fences, rally points, all of them, and an unknown type.
    for plan in [0, 1, 2, 255, 99] {
        for count in [0, 1, 65] {
            samples.push(at(&MISSION_COUNT_DATA { count, ..Default::default() }, 2, &[plan]));
            samples.push(at(&MISSION_REQUEST_DATA { seq: count, ..Default::default() }, 2, &[plan]));
            samples.push(at(&MISSION_REQUEST_INT_DATA { seq: count, ..Default::default() }, 2, &[plan]));
            samples.push(at(&MISSION_ITEM_DATA { seq: count, ..Default::default() }, 32, &[plan]));
            samples.push(at(&MISSION_ITEM_INT_DATA { seq: count, ..Default::default() }, 32, &[plan]));
        }
        samples.push(at(&MISSION_REQUEST_LIST_DATA::DEFAULT, 0, &[plan]));
        samples.push(at(&MISSION_CLEAR_ALL_DATA::DEFAULT, 0, &[plan]));
        samples.push(at(&MISSION_REQUEST_PARTIAL_LIST_DATA::DEFAULT, 4, &[plan]));
        samples.push(at(&MISSION_WRITE_PARTIAL_LIST_DATA::DEFAULT, 4, &[plan]));
    }
    for group in 0..16 {
        let mut sample =
            at(&REQUEST_DATA_STREAM_DATA { req_message_rate: 3, start_stop: 1, ..Default::default() }, 2, &[]);
        sample.payload[4] = group;
        samples.push(sample);
    }
    // Commands for vehicles, cameras and gimbals, and unknown ones.
    for command in [20_u16, 176, 246, 400, 401, 510, 511, 512, 521, 527, 1000, 2000, 2500, 31_010, 60_000] {
        for mut sample in [at(&COMMAND_LONG_DATA::DEFAULT, 30, &[]), at(&COMMAND_INT_DATA::DEFAULT, 30, &[])] {
            sample.payload[28..30].copy_from_slice(&command.to_le_bytes());
            samples.push(sample);
        }
    }
    for operation in (0..20).chain([100, 127]) {
        samples.push(file(9, 3, operation));
    }
    samples
}

/// Builds a request of MAVLink FTP.
fn file(sequence: u16, session: u8, operation: u8) -> Sample {
    let mut sample = at(&FILE_TRANSFER_PROTOCOL_DATA::DEFAULT, 1, &[]);
    sample.payload[3..5].copy_from_slice(&sequence.to_le_bytes());
    sample.payload[5..7].copy_from_slice(&[session, operation]);
    sample.payload[7] = 1;
    sample.payload[15] = b'/';
    sample
}

/// CRC-16/MCRF4XX.
fn crc(bytes: &[u8], extra: u8) -> u16 {
    bytes.iter().chain([&extra]).fold(0xFFFF, |crc, byte| {
        (0..8).fold(crc ^ u16::from(*byte), |crc, _| if crc & 1 == 1 { (crc >> 1) ^ 0x8408 } else { crc >> 1 })
    })
}

fn frame(from: Address, sample: &Sample) -> Vec<u8> {
    let [low, mid, high, _] = sample.id.to_le_bytes();
    let head = [0xFD, sample.payload.len() as u8, 0, 0, 0, from.system, from.component, low, mid, high];
    let mut frame = [head.as_slice(), &sample.payload].concat();
    let sum = crc(&frame[1..], MavMessage::extra_crc(sample.id));
    frame.extend_from_slice(&sum.to_le_bytes());
    frame
}

/// Returns the target of a vehicle's message, at its offset in MAVLink's field order. Returns none if the message has
/// no target.
fn receiver(sample: &Sample) -> Option<Address> {
    let byte = |at: usize| sample.payload.get(at).copied().unwrap_or(0);
    let at = match sample.id {
        // The message does not name the station's component.
        6 => return Some(Address { system: byte(0), component: 0 }),
        4 => 12,
        77 => 8,
        111 => 16,
        126 => 79,
        110 => 1,
        47 => 0,
        40 | 44 | 51 | 345 => 2,
        413 => 4,
        39 | 73 => 32,
        _ => return None,
    };
    Some(Address { system: byte(at), component: byte(at + 1) })
}

/// Returns a vehicle at rest that knows its position, on a full line of `baud`. Every stream is requested each
/// millisecond, except those that serve as answers.
fn on(baud: u32) -> Bench {
    let mut bench = Bench::new();
    bench.table =
        ParameterTable::new(Configuration { link: Link { baud, ..Link::DEFAULT }, ..Configuration::default() });
    bench.comms = Comms::with(Setup::of(&bench.table.configuration().link));
    let origin = EarthOrigin::new(Global { altitude_m: 400.0, ..EarthOrigin::SIMULATED });
    bench.comms.set_aux_sensors(AuxSensors { origin, ..AuxSensors::default() });
    for (message, _) in DEFAULTS {
        let answers = [id::MISSION_CURRENT, id::GPS_GLOBAL_ORIGIN, id::HOME_POSITION].contains(&message);
        let interval_us = if answers { -1 } else { 1_000 };
        bench.hear(Uplink::Command(VehicleCommand::SetInterval { message, interval_us }));
        step(&mut bench);
    }
    for _ in 0..100 {
        step(&mut bench);
    }
    bench
}

/// Runs a tick. Returns the messages sent.
fn step(bench: &mut Bench) -> Vec<Sample> {
    if bench.now_us.is_multiple_of(10_000) {
        bench.measure(&State::default());
    }
    bench.now_us += 1000;
    let Bench { flight, comms, table, inputs, taken, now_us, .. } = bench;
    inputs.take_into(taken);
    let report = flight.tick(*now_us, taken, &Readings::NONE);
    let (mut sent, mut bytes) = (Vec::new(), 0);
    let mut send = |frame: &[u8]| {
        bytes += frame.len();
        let id = u32::from_le_bytes([frame[7], frame[8], frame[9], 0]);
        sent.push(Sample { id, payload: frame[10..frame.len() - 2].to_vec() });
    };
    comms.report(&report, 0.0, &mut send);
    comms.parameters(table, &mut send);
    assert!(bytes <= afbc_comms::REPORT_MAX, "{bytes} bytes");
    sent
}

/// Sends the same request from these stations and runs ticks until each has an answer. Returns the answers. Panics if
/// an answer is missing.
fn ask(bench: &mut Bench, stations: &[Address], sample: &Sample, answers: &[u32]) -> Vec<Sample> {
    for station in stations {
        bench.hear_bytes(&frame(*station, sample));
    }
    let mut reported: Vec<Sample> = Vec::new();
    let mut waiting: BTreeSet<(u8, u8)> = stations.iter().map(|it| (it.system, it.component)).collect();
    for _ in 0..WITHIN {
        for answer in step(bench).into_iter().filter(|sent| answers.contains(&sent.id)) {
            match receiver(&answer) {
                Some(to) => {
                    let named = |station: &(u8, u8)| station.0 == to.system && [0, station.1].contains(&to.component);
                    waiting.retain(|station| !named(station));
                }
                None => waiting.clear(),
            }
            reported.push(answer);
        }
        if waiting.is_empty() {
            return reported;
        }
    }
    panic!("no answer to {waiting:?}: {sample:?}, but {reported:?}");
}

#[test]
fn every_request_of_the_dialect_is_answered() {
    let mut asked = BTreeSet::new();
    for sample in requests() {
        let message = MavMessage::default_message_from_id(sample.id).expect("of the dialect");
        let Expected::Answer(answers) = expected(&message) else { panic!("no request: {message:?}") };
        asked.insert(sample.id);
        for baud in [57_600, 921_600] {
            for stations in [&[STATION][..], &[STATION, OTHER]] {
                ask(&mut on(baud), stations, &sample, answers);
            }
        }
    }
    for id in MavMessage::all_ids() {
        let message = MavMessage::default_message_from_id(*id).expect("of the dialect");
        let is_request = matches!(expected(&message), Expected::Answer(_));
        assert_eq!(asked.contains(id), is_request, "{}", message.message_name());
    }
}

/// If other messages were answered, two vehicles would answer each other for ever.
#[test]
fn nothing_else_is_answered() {
    let quiet = |bench: &mut Bench, sample: &Sample| {
        bench.hear_bytes(&frame(STATION, sample));
        let sent: Vec<_> = (0..5).flat_map(|_| step(bench)).collect();
        let answers = sent.iter().filter(|sent| receiver(sent).is_some());
        assert_eq!(answers.count(), 0, "{sample:?}: {sent:?}");
    };
    let mut bench = on(921_600);
    for id in MavMessage::all_ids() {
        let message = MavMessage::default_message_from_id(*id).expect("of the dialect");
        if let Expected::None = expected(&message) {
            let mut payload = vec![0; 255];
            let length = message.ser(MavlinkVersion::V2, &mut payload);
            payload.truncate(length.max(1));
            quiet(&mut bench, &Sample { id: *id, payload });
        }
    }
    // These messages are answers themselves, or a SERIAL_CONTROL that wants no response.
    for operation in [128, 129, 255] {
        quiet(&mut bench, &file(9, 3, operation));
    }
    quiet(&mut bench, &extended(&PING_DATA { target_system: 1, target_component: 1, ..PING_DATA::DEFAULT }, &[]));
    quiet(&mut bench, &extended(&TIMESYNC_DATA { tc1: 5, ts1: 77 }, &[1, 1]));
    for flags in [SerialControlFlag::empty(), SerialControlFlag::SERIAL_CONTROL_FLAG_REPLY] {
        quiet(&mut bench, &extended(&SERIAL_CONTROL_DATA { flags, ..SERIAL_CONTROL_DATA::DEFAULT }, &[1, 1]));
    }
    // Requests to another system are not answered.
    for mut sample in requests() {
        let to = match sample.id {
            110 => 1,
            117 | 412 => 4,
            119 => 10,
            320 => 2,
            321 | 323 => 0,
            _ => continue,
        };
        sample.payload[to] = 7;
        quiet(&mut bench, &sample);
    }
}

/// The answer to a list request says that there are no logs. The answer to a data request says that the data end.
#[test]
fn there_are_no_logs() {
    let mut bench = on(921_600);
    let list = at(&LOG_REQUEST_LIST_DATA { start: 0, end: 0xFFFF, ..LOG_REQUEST_LIST_DATA::DEFAULT }, 4, &[]);
    let reported = ask(&mut bench, &[STATION], &list, &[118]);
    let entry = MavMessage::parse(MavlinkVersion::V2, 118, &reported[0].payload).expect("an entry");
    assert_eq!(entry, MavMessage::LOG_ENTRY(LOG_ENTRY_DATA::DEFAULT));
    let data = at(&LOG_REQUEST_DATA_DATA { ofs: 90, count: 900, id: 5, ..LOG_REQUEST_DATA_DATA::DEFAULT }, 10, &[]);
    let reported = ask(&mut bench, &[STATION], &data, &[120]);
    let none = MavMessage::parse(MavlinkVersion::V2, 120, &reported[0].payload).expect("data");
    assert_eq!(none, MavMessage::LOG_DATA(LOG_DATA_DATA { ofs: 90, id: 5, ..LOG_DATA_DATA::DEFAULT }));
}

/// Every operation is refused with the next sequence number, the same session and an error.
#[test]
fn every_file_operation_is_refused() {
    let mut bench = on(921_600);
    for operation in 0..128 {
        for (sequence, next) in [(0, 1), (777, 778), (u16::MAX, 0)] {
            let reported = ask(&mut bench, &[OTHER], &file(sequence, operation, operation), &[110]);
            assert_eq!(reported.len(), 1);
            let payload = &reported[0].payload;
            assert_eq!(u16::from_le_bytes([payload[3], payload[4]]), next);
            // The bytes are the session, NAK, the length of one byte, and the refused operation. The data byte means
            // UnknownCommand.
            assert_eq!(payload[5..9], [operation, 129, 1, operation]);
            assert_eq!(payload[15], 7);
        }
    }
}

/// The error for a missing parameter names the parameter.
#[test]
fn what_there_is_not_is_named() {
    let mut bench = on(921_600);
    let mut name = [0; 16];
    name[..4].copy_from_slice(b"NONE");
    let read = at(&PARAM_REQUEST_READ_DATA { param_index: -1, param_id: name.into(), ..Default::default() }, 2, &[]);
    let place = at(&PARAM_REQUEST_READ_DATA { param_index: 9_999, ..Default::default() }, 2, &[]);
    let set = at(&PARAM_SET_DATA { param_id: name.into(), ..Default::default() }, 4, &[]);
    for (sample, index, name) in [(read, -1_i16, name), (place, 9_999, [0; 16]), (set, -1, name)] {
        let reported = ask(&mut bench, &[OTHER], &sample, &[22, 345]);
        let mut payload = reported[0].payload.clone();
        payload.resize(21, 0);
        assert_eq!((reported[0].id, &payload[..2]), (345, index.to_le_bytes().as_slice()));
        // Error 1 means that the parameter does not exist.
        assert_eq!((&payload[4..20], payload[20]), (name.as_slice(), 1));
    }
    let read =
        at(&PARAM_EXT_REQUEST_READ_DATA { param_index: -1, param_id: name.into(), ..Default::default() }, 2, &[]);
    let reported = ask(&mut bench, &[OTHER], &read, &[322]);
    assert_eq!(
        (&reported[0].payload[..4], &reported[0].payload[4..20]),
        ([0, 0, 255, 255].as_slice(), name.as_slice())
    );
    let set = at(&PARAM_EXT_SET_DATA { param_id: name.into(), ..Default::default() }, 0, &[]);
    let reported = ask(&mut bench, &[OTHER], &set, &[324]);
    assert_eq!((&reported[0].payload[..16], reported[0].payload[145]), (name.as_slice(), 1));
}

/// MAV_CMD_REQUEST_MESSAGE is answered for every message of the dialect: the message is sent, or refused.
#[test]
fn any_message_can_be_requested() {
    for message in MavMessage::all_ids() {
        let mut bench = on(921_600);
        bench.hear(Uplink::Command(VehicleCommand::RequestMessage { message: *message, index: 0 }));
        let sent: Vec<_> = (0..WITHIN).flat_map(|_| step(&mut bench)).collect();
        let answer = sent.iter().find(|sent| sent.id == 77).expect("answered");
        assert_eq!(receiver(answer), Some(STATION));
        let accepted = answer.payload.get(2).copied().unwrap_or(0) == 0;
        assert!(!accepted || sent.iter().any(|sent| sent.id == *message), "message {message}");
    }
}

/// A mission is uploaded with MISSION_ITEM, which has floating-point places.
#[test]
fn a_mission_is_uploaded_by_messages_of_old() {
    let mut bench = on(921_600);
    let next = |reported: &[Sample], number: u16| {
        let bytes = reported[0].payload.clone();
        assert_eq!((reported[0].id, bytes.first().copied()), (51, Some(number as u8)), "{reported:?}");
    };
    let count = at(&MISSION_COUNT_DATA { count: 2, ..Default::default() }, 2, &[0]);
    next(&ask(&mut bench, &[STATION], &count, &[51, 47]), 0);
    let item = |seq: u16, frame: MavFrame, [x, y, z]: [f32; 3]| {
        let command = MavCmd::MAV_CMD_NAV_WAYPOINT;
        let data = MISSION_ITEM_DATA { seq, x, y, z, frame, command, ..MISSION_ITEM_DATA::DEFAULT };
        at(&data, 32, &[0])
    };
    let first = item(0, MavFrame::MAV_FRAME_GLOBAL_RELATIVE_ALT, [47.5, 8.25, 10.0]);
    next(&ask(&mut bench, &[STATION], &first, &[51, 47]), 1);
    let second = item(1, MavFrame::MAV_FRAME_LOCAL_NED, [12.5, -3.25, -4.0]);
    let reported = ask(&mut bench, &[STATION], &second, &[51, 47]);
    assert_eq!((reported[0].id, reported[0].payload.get(2).copied().unwrap_or(0)), (47, 0), "{reported:?}");
    for (number, x, y) in [(0, 475_000_000, 82_500_000), (1, 125_000, -32_500)] {
        let request = at(&MISSION_REQUEST_INT_DATA { seq: number, ..Default::default() }, 2, &[0]);
        let reported = ask(&mut bench, &[OTHER], &request, &[73, 47]);
        let read = MavMessage::parse(MavlinkVersion::V2, reported[0].id, &reported[0].payload);
        let Ok(MavMessage::MISSION_ITEM_INT(item)) = read else { panic!("{read:?}") };
        assert_eq!((item.x, item.y), (x, y));
    }
}

//! Stored parameters survive restarts of the server and of a vehicle.
#![allow(clippy::unwrap_used, missing_docs, reason = "tests")]

use afbc_mavlink::{
    Address, Decoder, Downlink, Encoder, FRAME_MAX, ParameterName, ParameterRequest, Reboot, ReceivedFrame,
    SIGNED_FRAME_MAX, SetupSigning, SigningKey, Stamp, Storage, Uplink, VehicleCommand,
};
use afbc_scenario::built_in;
use afbc_serve::{ParameterFile, Server, fleet};
use std::path::{Path, PathBuf};

const STATION: Address = Address { system: 255, component: 190 };

fn name(text: &str) -> ParameterName {
    std::array::from_fn(|i| text.as_bytes().get(i).copied().unwrap_or(0))
}

/// Returns the path of a file that does not exist yet.
fn fresh(test: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{test}.store"));
    let _ = std::fs::remove_file(&path);
    path
}

fn served(file: &Path) -> Server {
    let scenarios = fleet(&built_in("outdoor").unwrap().read().unwrap(), 1).unwrap();
    let keeper = ParameterFile::open(file, scenarios.first().unwrap()).unwrap();
    Server::with_parameter_files(&scenarios, 1, vec![keeper]).unwrap()
}

/// Sends a message; returns the messages and lines of the next tenth of a second.
fn exchange(server: &mut Server, message: Uplink) -> (Vec<Downlink>, Vec<String>) {
    server.hear(0, 1, Encoder::new(STATION).send(&message, &mut [0; FRAME_MAX]));
    let (mut messages, mut lines) = (Vec::new(), Vec::new());
    let mut decoder = Decoder::<Downlink>::new(STATION);
    for _ in 0..100 {
        let hear = |_, bytes: &[u8]| decoder.feed(bytes, |_, message| messages.push(message));
        let _ = server.step(hear, |line| lines.push(line.to_owned()));
    }
    (messages, lines)
}

fn set(server: &mut Server, text: &str, value: f32) {
    let request = ParameterRequest::Set { name: name(text), value: value.to_le_bytes(), kind: 9 };
    exchange(server, Uplink::Parameter(request));
}

fn bytes(server: &mut Server, text: &str) -> [u8; 4] {
    let request = Uplink::Parameter(ParameterRequest::ReadName(name(text)));
    let value = exchange(server, request).0.into_iter().find_map(|message| match message {
        Downlink::Parameter(value) if value.name == name(text) => Some(value.value),
        _ => None,
    });
    value.unwrap()
}

fn get(server: &mut Server, text: &str) -> f32 {
    f32::from_le_bytes(bytes(server, text))
}

/// Returns an integer parameter, which MAVLink carries as an integer.
fn whole(server: &mut Server, text: &str) -> i32 {
    i32::from_le_bytes(bytes(server, text))
}

#[test]
fn what_is_set_is_there_after_a_restart() {
    let file = fresh("restart");
    let mut server = served(&file);
    let default = get(&mut server, "MIS_TAKEOFF_ALT");
    set(&mut server, "MIS_TAKEOFF_ALT", 4.0);
    set(&mut server, "RTL_RETURN_ALT", 20.0);
    set(&mut server, "RTL_RETURN_ALT", 22.0);
    // The file is locked: only one program at a time may write it.
    let scenario = built_in("outdoor").unwrap().read().unwrap();
    assert!(ParameterFile::open(&file, &scenario).err().unwrap().contains("another program uses"));
    drop(server);

    let mut server = served(&file);
    assert_eq!(["MIS_TAKEOFF_ALT", "RTL_RETURN_ALT"].map(|text| get(&mut server, text)), [4.0, 22.0]);
    exchange(&mut server, Uplink::Command(VehicleCommand::Storage(Storage::Reset)));
    drop(server);
    assert_eq!(get(&mut served(&file), "MIS_TAKEOFF_ALT"), default);
}

/// A reboot is acknowledged first, and then restarts the vehicle with its stored parameters.
#[test]
fn a_reboot_restarts_the_vehicle() {
    let mut server = served(&fresh("reboot"));
    set(&mut server, "MIS_TAKEOFF_ALT", 4.0);
    let (messages, lines) = exchange(&mut server, Uplink::Command(VehicleCommand::Reboot(Reboot::Program)));
    assert!(messages.iter().any(|message| matches!(message, Downlink::CommandAck { command: 246, .. })));
    assert!(lines.iter().any(|line| line.ends_with("vehicle 1: restarted")), "{lines:?}");
    assert_eq!(get(&mut server, "MIS_TAKEOFF_ALT"), 4.0);
    // The vehicle restarts only once.
    let (_, lines) = exchange(&mut server, Uplink::Heartbeat);
    assert!(!lines.iter().any(|line| line.contains("restarted")), "{lines:?}");

    // Without a file, the vehicle restarts with default parameters.
    let scenarios = fleet(&built_in("outdoor").unwrap().read().unwrap(), 1).unwrap();
    let mut server = Server::new(&scenarios, 1).unwrap();
    let default = get(&mut server, "MIS_TAKEOFF_ALT");
    set(&mut server, "MIS_TAKEOFF_ALT", 4.0);
    assert_eq!(get(&mut server, "MIS_TAKEOFF_ALT"), 4.0);
    exchange(&mut server, Uplink::Command(VehicleCommand::Reboot(Reboot::Program)));
    assert_eq!(get(&mut server, "MIS_TAKEOFF_ALT"), default);
}

/// Returns the system id of the vehicle's heartbeats.
fn heartbeat_of(server: &mut Server, vehicle: usize) -> u8 {
    let mut decoder = Decoder::<Downlink>::new(STATION);
    let mut system = None;
    for _ in 0..1100 {
        let hear = |place, bytes: &[u8]| {
            decoder.feed(if place == vehicle { bytes } else { &[] }, |from, message| {
                if matches!(message, Downlink::Heartbeat { .. }) {
                    system = Some(from.system);
                }
            });
        };
        let _ = server.step(hear, |_| ());
    }
    system.unwrap()
}

/// A new MAV_SYS_ID takes effect at the next restart, with a parameter file and without. Default ids count up from the
/// first one. A shared id is reported.
#[test]
fn the_system_id_is_a_parameter() {
    let mut server = served(&fresh("system"));
    set(&mut server, "MAV_SYS_ID", 0.0);
    set(&mut server, "MAV_SYS_ID", 251.0);
    set(&mut server, "MAV_SYS_ID", 7.5);
    assert_eq!(whole(&mut server, "MAV_SYS_ID"), 1);
    set(&mut server, "MAV_SYS_ID", 42.0);
    assert_eq!((heartbeat_of(&mut server, 0), server.systems()), (1, vec![1]));
    exchange(&mut server, Uplink::Command(VehicleCommand::Reboot(Reboot::Program)));
    assert_eq!((heartbeat_of(&mut server, 0), server.systems()), (42, vec![42]));
    // The vehicle answers to its new id, and commands know it by that id.
    assert_eq!(whole(&mut server, "MAV_SYS_ID"), 42);
    assert!(server.line("vehicle 1 status").lines.join("").contains("no vehicle 1"));
    assert!(server.line("vehicle 42 status").lines.join("").contains("ok"));
    drop(server);
    let mut server = served(&Path::new(env!("CARGO_TARGET_TMPDIR")).join("system.store"));
    assert_eq!((heartbeat_of(&mut server, 0), server.systems()), (42, vec![42]));

    let scenarios = fleet(&built_in("outdoor").unwrap().read().unwrap(), 3).unwrap();
    let files = ["system1", "system2", "system3"].map(fresh);
    let keepers = || files.iter().zip(&scenarios).map(|(file, it)| ParameterFile::open(file, it).unwrap()).collect();
    let mut server = Server::with_parameter_files(&scenarios, 5, keepers()).unwrap();
    assert_eq!((server.systems(), server.ambiguous()), (vec![5, 6, 7], None));
    set(&mut server, "MAV_SYS_ID", 7.0);
    let (_, lines) = exchange(&mut server, Uplink::Command(VehicleCommand::Reboot(Reboot::Program)));
    assert!(lines.iter().any(|line| line.contains("several vehicles have the system id 7")), "{lines:?}");
    assert_eq!((server.systems(), server.ambiguous()), (vec![7, 6, 7], Some(7)));
    drop(server);
    assert_eq!(Server::with_parameter_files(&scenarios, 5, keepers()).unwrap().systems(), [7, 6, 7]);
}

/// Returns the number of messages in a tenth of a second, and how many of them are signed with this key.
fn signed(server: &mut Server, key: &SigningKey) -> [usize; 2] {
    let (mut count, mut genuine) = (0, 0);
    let mut decoder = Decoder::<Downlink>::new(STATION);
    for _ in 0..100 {
        let hear = |_, bytes: &[u8]| {
            let accept = |frame: &ReceivedFrame<'_>| {
                genuine += usize::from(frame.is_signed_by(key));
                true
            };
            decoder.feed_accepted(bytes, accept, |_, _| count += 1);
        };
        let _ = server.step(hear, |_| ());
    }
    [count, genuine]
}

/// The signing key survives a restart of the server, and a restart of the vehicle by a signed command.
#[test]
fn a_key_of_signatures_is_kept() {
    let (file, key) = (fresh("signing"), SigningKey([7; 32]));
    let mut server = served(&file);
    server.set_wired(true);
    let setup = SetupSigning { key: Some(key), time_10us: 37_000_000_000_000 };
    exchange(&mut server, Uplink::Signing(setup));
    let [count, genuine] = signed(&mut server, &key);
    assert!(count > 0 && genuine == count, "{genuine} of {count}");
    drop(server);

    let mut server = served(&file);
    let [count, genuine] = signed(&mut server, &key);
    assert!(count > 0 && genuine == count, "after a restart: {genuine} of {count}");
    let stamp = Stamp { link: 0, time_10us: 37_000_100_000_000 };
    let reboot = Uplink::Command(VehicleCommand::Reboot(Reboot::Program));
    let mut buffer = [0; SIGNED_FRAME_MAX];
    server.hear(0, 1, Encoder::new(STATION).send_signed(&reboot, Some((&key, stamp)), &mut buffer));
    let mut lines = Vec::new();
    for _ in 0..300 {
        let _ = server.step(|_, _| (), |line| lines.push(line.to_owned()));
    }
    assert!(lines.iter().any(|line| line.contains("restarted")), "{lines:?}");
    let [count, genuine] = signed(&mut server, &key);
    assert!(count > 0 && genuine == count, "after the vehicle's restart: {genuine} of {count}");
}

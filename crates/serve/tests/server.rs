//! Tests of the server in lockstep, without clock and sockets.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs, reason = "tests")]

use afbc_mavlink::{Address, Decoder, Downlink, Encoder, FRAME_MAX, Uplink, VehicleCommand};
use afbc_plant::InstrumentSuite;
use afbc_scenario::{Scenario, built_in};
use afbc_serve::{Server, ServerAction, fleet};

/// A command that no vehicle knows; it is answered, too.
const UNKNOWN: u16 = 31_999;
const STATION: Address = Address { system: 255, component: 190 };
const COMPANION: Address = Address { system: 245, component: 191 };

fn scenario(name: &str) -> Scenario {
    built_in(name).unwrap().read().unwrap()
}

fn served(name: &str, vehicles: u8) -> Server {
    Server::new(&fleet(&scenario(name), vehicles).unwrap(), 1).unwrap()
}

/// Output of some milliseconds: bytes of each vehicle, and lines.
#[derive(Debug, Default, PartialEq)]
struct Said {
    bytes: Vec<Vec<u8>>,
    lines: Vec<String>,
}

fn run(server: &mut Server, milliseconds: u32) -> Said {
    let mut said = Said { bytes: vec![Vec::new(); server.vehicles().len()], lines: Vec::new() };
    for _ in 0..milliseconds {
        let Said { bytes, lines } = &mut said;
        let _ = server.step(|vehicle, sent| bytes[vehicle].extend_from_slice(sent), |line| lines.push(line.into()));
    }
    said
}

/// Returns the messages in `bytes`, each with its sender.
fn read(bytes: &[u8]) -> Vec<(Address, Downlink)> {
    let (mut messages, mut decoder) = (Vec::new(), Decoder::<Downlink>::new(STATION));
    decoder.feed(bytes, |from, message| messages.push((from, message)));
    assert_eq!(decoder.counters().bad_checksum + decoder.counters().skipped_bytes, 0);
    messages
}

fn frame(from: Address, message: Uplink) -> Vec<u8> {
    Encoder::new(from).send(&message, &mut [0; FRAME_MAX]).to_vec()
}

fn answers(bytes: &[u8]) -> Vec<(u8, u16)> {
    let answer = |message: &(Address, Downlink)| match message.1 {
        Downlink::CommandAck { command, to, .. } => Some((to.system, command)),
        _ => None,
    };
    read(bytes).iter().filter_map(answer).collect()
}

fn ok(server: &mut Server, line: &str) {
    let reply = server.line(line);
    assert_eq!(reply.lines, [format!("ok {line}")], "{line}");
}

fn status(server: &mut Server) -> String {
    server.line("status").lines.concat()
}

/// The vehicle neither sinks, tips over nor takes off, and it has an estimate.
#[test]
fn a_vehicle_stands_where_it_was_put() {
    for name in ["outdoor", "mocap"] {
        let mut server = served(name, 3);
        run(&mut server, 20_000);
        for (place, vehicle) in server.vehicles().iter().enumerate() {
            let motion = vehicle.world().plant().motion();
            let start = fleet(&scenario(name), 3).unwrap()[place].initial;
            // The breeze makes it creep slowly, because of the friction model.
            let off_m = (motion.position_m - start.position_m).norm();
            assert!(off_m < 0.2, "{name} {place}: {off_m} m");
            assert!(motion.attitude_rad.xy().norm() < 0.02 && motion.position_m.z > 0.05, "{name}: {motion:?}");
        }
    }
}

#[test]
fn each_vehicle_has_its_own_system_id_and_heartbeat() {
    let mut server = Server::new(&fleet(&scenario("outdoor"), 3).unwrap(), 7).unwrap();
    let said = run(&mut server, 3000);
    for (bytes, system) in said.bytes.iter().zip(7..) {
        let messages = read(bytes);
        assert!(messages.iter().all(|(from, _)| *from == Address { system, component: 1 }));
        let beats = messages.iter().filter(|(_, message)| matches!(message, Downlink::Heartbeat { .. })).count();
        assert!((3..=4).contains(&beats), "{beats}");
    }
    assert_ne!(said.bytes[0].len(), 0);
}

/// The same lines and bytes at the same milliseconds give the same output; another seed gives another output.
#[test]
fn the_same_session_twice_is_the_same_to_the_bit() {
    let session = |seed: u64| {
        let scenario = Scenario { seed, ..scenario("outdoor") };
        let mut server = Server::new(&fleet(&scenario, 2).unwrap(), 1).unwrap();
        ok(&mut server, "at 1.5 vehicle 2 gust 3 0 0 0.5 1");
        let mut all = vec![run(&mut server, 1000)];
        ok(&mut server, "fault magnetometer lost 0.5");
        ok(&mut server, "wind 4 -1 0");
        server.hear(0, 1, &frame(STATION, Uplink::Command(VehicleCommand::Arm)));
        server.hear(1, 9, b"noise \xfd\x09");
        all.push(run(&mut server, 1500));
        ok(&mut server, "turbulence severe");
        ok(&mut server, "rotor 3 0.5");
        all.push(run(&mut server, 500));
        all.push(Said { bytes: Vec::new(), lines: server.line("status").lines });
        all
    };
    assert_eq!(session(1), session(1));
    assert_ne!(session(1), session(2));
}

/// Frames in pieces arrive even if pieces of other peers' frames come in between, and each peer gets its own answer.
#[test]
fn the_streams_of_peers_do_not_mix() {
    let mut server = served("outdoor", 1);
    run(&mut server, 10);
    let command = Uplink::Command(VehicleCommand::Other(UNKNOWN));
    let (here, there) = (frame(STATION, command), frame(COMPANION, command));
    let mut heard = Vec::new();
    for place in 0..here.len().max(there.len()) {
        server.hear(0, 1, here.get(place..=place).unwrap_or_default());
        server.hear(0, 2, there.get(place..=place).unwrap_or_default());
        // A third peer sends the beginning of a frame that never ends.
        server.hear(0, 3, &[0xfd]);
        heard.extend(answers(&run(&mut server, 1).bytes[0]));
    }
    heard.extend(answers(&run(&mut server, 50).bytes[0]));
    heard.sort_unstable();
    assert_eq!(heard, [(COMPANION.system, UNKNOWN), (STATION.system, UNKNOWN)]);
    // A peer that comes back starts with a new frame.
    server.hear(0, 1, &here[..20]);
    server.forget(0, 1);
    server.hear(0, 1, &here);
    assert_eq!(answers(&run(&mut server, 50).bytes[0]), [(STATION.system, UNKNOWN)]);
}

#[test]
fn what_is_sent_to_one_vehicle_reaches_no_other() {
    let mut server = served("mocap", 3);
    run(&mut server, 10);
    server.hear(1, 1, &frame(STATION, Uplink::Command(VehicleCommand::Other(UNKNOWN))));
    let said = run(&mut server, 50);
    let counts: Vec<usize> = said.bytes.iter().map(|bytes| answers(bytes).len()).collect();
    assert_eq!(counts, [0, 1, 0]);
}

#[test]
fn faults_and_weather_change_what_flies_and_are_reported() {
    let mut server = served("outdoor", 2);
    run(&mut server, 2000);
    let wind = |server: &Server, place: usize| server.vehicles()[place].world().plant().telemetry().unwrap().wind_m_s;
    ok(&mut server, "turbulence none");
    ok(&mut server, "vehicle 2 wind 5 -2 0.5");
    run(&mut server, 1);
    assert_eq!(wind(&server, 0).data.0, [[2.0, 1.0, 0.0]]);
    assert_eq!(wind(&server, 1).data.0, [[5.0, -2.0, 0.5]]);
    ok(&mut server, "vehicle 1 gust 0 6 0 0.1 0.2");
    run(&mut server, 150);
    assert_eq!(wind(&server, 0).data.0, [[2.0, 7.0, 0.0]]);
    run(&mut server, 300);
    assert_eq!(wind(&server, 0).data.0, [[2.0, 1.0, 0.0]]);

    ok(&mut server, "vehicle 1 fault gnss lost 1");
    ok(&mut server, "vehicle 1 rotor 2 0.6");
    assert!(status(&mut server).contains("gnss-lost, rotor 2 at 0.6"));
    run(&mut server, 1001);
    assert!(!status(&mut server).contains("gnss-lost"));
    ok(&mut server, "battery 0.2");
    ok(&mut server, "clear");
    run(&mut server, 1);
    let reported = status(&mut server);
    assert!(!reported.contains("rotor") && reported.matches(" 20 %").count() == 2, "{reported}");
    assert!((wind(&server, 1) - wind(&server, 0)).norm() > 0.0, "turbulence is the scenario's again");
}

/// A push lifts a vehicle off the ground, and ends after its duration.
#[test]
fn a_push_pushes_and_ends() {
    let mut server = served("mocap", 2);
    run(&mut server, 100);
    ok(&mut server, "vehicle 2 push 0 0 10 0.5");
    run(&mut server, 500);
    let speed = |server: &Server, place: usize| server.vehicles()[place].world().plant().motion().velocity_m_s.z;
    // 10 N act on 0.486 kg for half a second, minus its weight.
    assert!((speed(&server, 1) - (10.0 / 0.486 - 9.81) * 0.5).abs() < 0.5, "{}", speed(&server, 1));
    assert!(speed(&server, 0).abs() < 0.01);
    run(&mut server, 100);
    assert!(speed(&server, 1) < 5.4 - 0.09 * 9.81, "{}", speed(&server, 1));
}

#[test]
fn lines_with_a_time_are_carried_out_then_and_in_order() {
    let mut server = served("mocap", 1);
    for line in ["at 0.3 battery 0.3", "at 0.1 battery 0.1", "at 0.3 battery 0.5", "at 0.2 quit", "at 0.4 speed 3"] {
        ok(&mut server, line);
    }
    let mut reported = Vec::new();
    let mut ends = Vec::new();
    for step in 0..500 {
        match server.step(|_, _| (), |line| reported.push(line.to_owned())) {
            ServerAction::Nothing => {}
            action => ends.push((step, action)),
        }
    }
    assert_eq!(ends, [(200, ServerAction::Quit), (400, ServerAction::Speed(3.0))]);
    let wanted = [
        "0.100 ok at 0.1 battery 0.1",
        "0.200 ok at 0.2 quit",
        "0.300 ok at 0.3 battery 0.3",
        "0.300 ok at 0.3 battery 0.5",
        "0.400 ok at 0.4 speed 3",
    ];
    assert_eq!(reported, wanted);
    assert!(status(&mut server).contains("50 %"));
    assert_eq!(server.line("at 0.4 battery 1").lines, ["error 0.4 s has passed; the time is now 0.500 s"]);
}

/// Every bad line gets one line that begins with `error`, and changes nothing.
#[test]
fn bad_lines_are_refused_in_one_line() {
    let lines = [
        ("foo", "\"foo\": no such command; help lists the commands"),
        ("wnd 1 2 3", "\"wnd\": no such command; did you mean wind?"),
        ("wind 1 2", "wind X Y Z: three numbers are needed"),
        ("wind 1 2 x", "wind X Y Z: \"x\" is no number"),
        ("wind 1 2 3 4", "wind X Y Z: \"4\" is too much"),
        ("wind 1 2 nan", "wind: steady_m_s = NaN, out of range: it must lie within -50 to 50"),
        ("wind 1 2 1e9", "wind: steady_m_s = 1000000000, out of range: it must lie within -50 to 50"),
        ("rotor 0 0.5", "rotor: \"0\" is not the number of a rotor, 1 to 8"),
        ("rotor 5 0.5", "rotor = 5, out of range: it must lie within 1 to 4"),
        ("rotor 2 1.5", "rotor: efficiency = 1.5, out of range: it must lie within 0 to 1"),
        ("battery", "battery SHARE: initial_charge is missing"),
        ("fault", "fault INSTRUMENT FAILURE [NUMBERS] [SECONDS]: it needs an instrument, as in: fault gnss lost"),
        ("fault gps lost", "fault: \"gps\" is no instrument; write imu, tracker, gnss, barometer or magnetometer"),
        ("fault gnss stuck", "fault gnss: \"stuck\" is none of lost, jumped, multipath"),
        ("fault tracker lost", "this vehicle has no tracker"),
        ("fault gnss lost -3", "fault: seconds = -3, out of range: it must lie within 0 to 1000000"),
        ("turbulence strong", "turbulence: \"strong\" is not one of none, light, moderate, severe"),
        (
            "change weight 2",
            "change: \"weight\" is not one of mass, inertia, thrust-factor, drag-factor, \
             roll-moment, pitch-moment, yaw-moment",
        ),
        ("vehicle 9 clear", "there is no vehicle 9; they are 1 to 2"),
        ("at", "at SECONDS COMMAND: at is missing"),
        ("at 5", "a command is missing"),
        ("at 5 step 3", "step cannot be scheduled for later"),
        ("at 5 at 6 clear", "at: a second time"),
        ("step 0", "step: \"0\" is not milliseconds, 1 to 3600000"),
        ("speed -1", "speed: speed = -1, out of range: it must lie within 0 to 1000"),
        ("\u{1b}[31m", "\"\\u{1b}[31m\": no such command; help lists the commands"),
    ];
    let mut server = served("outdoor", 2);
    run(&mut server, 100);
    let before = status(&mut server);
    for (line, wanted) in lines {
        let reply = server.line(line);
        assert_eq!((reply.lines, reply.action), (vec![format!("error {wanted}")], ServerAction::Nothing), "{line}");
    }
    let long = server.line(&"x".repeat(100_000)).lines;
    assert!(long.len() == 1 && long[0].len() < 200);
    assert_eq!(status(&mut server), before);
    for line in ["", "   ", "# a comment"] {
        assert_eq!(server.line(line).lines, [""; 0]);
    }
}

#[test]
fn every_command_is_helped_with_and_every_failure_is_known() {
    let mut server = served("outdoor", 1);
    let help = server.line("help").lines;
    for name in ["wind", "turbulence", "gust", "push", "payload", "change", "fault", "rotor", "battery", "clear"] {
        assert!(help.iter().any(|line| line.starts_with(name)), "{name}");
    }
    for line in [
        "fault imu stuck",
        "fault imu dead 0.1",
        "fault imu noisy 0.1 1 2",
        "fault imu clipped 1 20",
        "fault imu biased 0.1 0 0 0.5 0 0 3",
        "fault gnss lost",
        "fault gnss jumped 5 0 0 2",
        "fault gnss multipath 5 10 2",
        "fault barometer lost",
        "fault barometer stuck",
        "fault barometer blocked",
        "fault magnetometer lost",
        "fault magnetometer stuck",
        "fault magnetometer disturbed 30 0 0 1",
        "payload 0.1 0.2",
        "payload 0",
        "change mass 1.1 2",
        "change yaw-moment -1",
        "push 1 0 0",
    ] {
        ok(&mut server, line);
        run(&mut server, 5);
    }
    let mut indoors = served("mocap", 1);
    for line in ["fault tracker lost 1", "fault tracker frozen 3", "fault tracker jumped 1 0 0 0.2"] {
        ok(&mut indoors, line);
    }
}

#[test]
fn what_the_firmware_cannot_fly_is_refused() {
    let blind = Scenario { instruments: InstrumentSuite::default(), ..scenario("outdoor") };
    let refused = fleet(&blind, 1).unwrap_err().to_string();
    assert!(refused.contains("outdoor: the vehicle has no sensors to fly with"), "{refused}");
    let mut heavy = scenario("outdoor");
    heavy.vehicle.mass_kg *= 1.5;
    assert!(fleet(&heavy, 1).unwrap_err().to_string().contains("another vehicle"));
}

/// Sending line after line uses bounded memory, and does not make steps slower and slower.
#[test]
fn what_lines_leave_behind_is_bounded() {
    let mut server = served("outdoor", 1);
    run(&mut server, 10);
    for line in ["push 0 0 0.1", "change mass 1.001", "gust 0 0 1 1 100000", "fault gnss lost", "fault imu dead 50"] {
        let taken = (0..2000).take_while(|_| server.line(line).lines == [format!("ok {line}")]).count();
        assert!((100..=256).contains(&taken), "{line}: {taken}");
        let refused = server.line(line).lines.concat();
        assert_eq!(refused, "error 256 changes of this kind act already; `clear` ends them", "{line}");
        // Other changes are still accepted, and the suggested remedy works.
        ok(&mut server, "battery 0.9");
        ok(&mut server, "clear");
        ok(&mut server, line);
    }
    // Changes that are over make room for new ones.
    ok(&mut server, "clear");
    for _ in 0..2000 {
        ok(&mut server, "fault gnss lost 0.001");
        ok(&mut server, "push 0 0 0.1 0.001");
        run(&mut server, 2);
    }
    let long = format!("at 1000 wind 1 0 0 # {}", "x".repeat(16_000));
    assert_eq!(server.line(&long).lines, ["error a line has at most 512 characters"]);
    let taken = (0..2000).take_while(|_| server.line("at 1000 wind 1 0 0").lines == ["ok at 1000 wind 1 0 0"]).count();
    assert_eq!(taken, 1000);
    assert!(server.line("at 1000 wind 1 0 0").lines.concat().starts_with("error 1000 scheduled lines are waiting"));
    ok(&mut server, "wind 1 0 0");
}

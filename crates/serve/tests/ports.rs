//! Tests of the ports, on loopback at free ports. No test depends on the speed of the machine.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs, reason = "tests")]

use afbc_mavlink::{Address, Decoder, Downlink, Encoder, FRAME_MAX, Uplink, VehicleCommand};
use afbc_scenario::built_in;
use afbc_serve::{Addresses, InputLines, Interfaces, Ports, RunEnd, Server, TimeRate, fleet, run};
use std::io::{Cursor, ErrorKind, Read, Write};
use std::net::{TcpStream, UdpSocket};
use std::sync::atomic::AtomicBool;
use std::time::Duration;

const STATION: Address = Address { system: 255, component: 190 };

fn served(vehicles: u8) -> Server {
    Server::new(&fleet(&built_in("mocap").unwrap().read().unwrap(), vehicles).unwrap(), 1).unwrap()
}

fn free() -> Addresses {
    Addresses { udp: 0, stations: Vec::new(), companions: Vec::new(), tcp: Some(0), ..Addresses::default() }
}

fn socket() -> UdpSocket {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.set_nonblocking(true).unwrap();
    socket
}

/// Runs `server` for this many milliseconds; the ports' clock stands at `now`.
fn steps(server: &mut Server, ports: &mut Ports, milliseconds: u32, now: Duration) -> Vec<String> {
    let mut reported = Vec::new();
    for _ in 0..milliseconds {
        ports.receive(server, now, |line| reported.push(line.into()));
        let _ = server.step(|vehicle, bytes| ports.send(vehicle, bytes), |line| reported.push(line.into()));
    }
    reported
}

/// Returns the datagrams that have arrived.
fn datagrams(socket: &UdpSocket) -> Vec<Vec<u8>> {
    let (mut all, mut buffer) = (Vec::new(), [0; 65_536]);
    while let Ok((length, _)) = socket.recv_from(&mut buffer) {
        all.push(buffer[..length].to_vec());
    }
    all
}

fn messages(datagrams: &[Vec<u8>]) -> Vec<Downlink> {
    let mut messages = Vec::new();
    for datagram in datagrams {
        // Each datagram holds complete frames.
        let mut decoder = Decoder::<Downlink>::new(STATION);
        let before = messages.len();
        decoder.feed(datagram, |_, message| messages.push(message));
        assert!(messages.len() > before && decoder.counters().skipped_bytes == 0);
    }
    messages
}

fn command() -> Vec<u8> {
    Encoder::new(STATION).send(&Uplink::Command(VehicleCommand::Other(31_999)), &mut [0; FRAME_MAX]).to_vec()
}

fn answers(messages: &[Downlink]) -> usize {
    messages.iter().filter(|message| matches!(message, Downlink::CommandAck { .. })).count()
}

/// Stations get heartbeats without asking. A client that sends a frame gets everything, until it has been silent too
/// long.
#[test]
fn stations_get_heartbeats_and_whoever_asks_gets_everything() {
    let (station, companion, other) = (socket(), socket(), socket());
    let of = |socket: &UdpSocket| vec![socket.local_addr().unwrap()];
    let addresses = Addresses { stations: of(&station), companions: of(&companion), ..free() };
    let (mut server, mut ports) = (served(1), Ports::open(&addresses, 1).unwrap());
    let vehicle = ports.addresses().unwrap()[0].0;
    let early = steps(&mut server, &mut ports, 2500, Duration::ZERO);
    assert_eq!(early, [""; 0]);
    for socket in [&station, &companion] {
        let beats = messages(&datagrams(socket));
        assert!((2..=3).contains(&beats.len()), "{beats:?}");
        assert!(beats.iter().all(|message| matches!(message, Downlink::Heartbeat { .. })));
    }
    assert!(datagrams(&other).is_empty());

    other.send_to(&command(), vehicle).unwrap();
    station.send_to(&command(), vehicle).unwrap();
    let reported = steps(&mut server, &mut ports, 200, Duration::from_secs(3));
    assert_eq!(reported.len(), 2, "{reported:?}");
    let (at_station, at_other) = (messages(&datagrams(&station)), messages(&datagrams(&other)));
    // Every frame goes to all peers, so both get both answers.
    assert_eq!(at_station, at_other);
    assert!(at_other.len() > 10 && answers(&at_other) == 2, "{at_other:?}");
    assert!(datagrams(&companion).len() <= 1);

    station.send_to(&command(), vehicle).unwrap();
    steps(&mut server, &mut ports, 20, Duration::from_secs(50));
    let reported = steps(&mut server, &mut ports, 2000, Duration::from_secs(64));
    assert_eq!(reported, [format!("2.720 vehicle 1: udp {} gone", other.local_addr().unwrap())]);
    let _ = datagrams(&other);
    steps(&mut server, &mut ports, 100, Duration::from_secs(64));
    assert!(datagrams(&other).is_empty() && !datagrams(&station).is_empty());
}

#[test]
fn vehicles_are_at_counted_ports_and_hear_their_own() {
    let (first, second) = (socket(), socket());
    let (mut server, mut ports) = (served(2), Ports::open(&free(), 2).unwrap());
    let vehicles = ports.addresses().unwrap();
    first.send_to(&command(), vehicles[0].0).unwrap();
    second.send_to(&command(), vehicles[1].0).unwrap();
    second.send_to(&command(), vehicles[1].0).unwrap();
    steps(&mut server, &mut ports, 20, Duration::ZERO);
    assert_eq!(answers(&messages(&datagrams(&first))), 1);
    assert_eq!(answers(&messages(&datagrams(&second))), 2);
}

/// TCP clients send frames in pieces; one of them breaks off within a frame.
#[test]
fn tcp_streams_are_peers_too() {
    let (mut server, mut ports) = (served(1), Ports::open(&free(), 1).unwrap());
    let address = ports.addresses().unwrap()[0].1.unwrap();
    let [mut here, mut there] = [(); 2].map(|()| TcpStream::connect(address).unwrap());
    let (half, rest) = (command()[..9].to_vec(), command()[9..].to_vec());
    here.write_all(&half).unwrap();
    there.write_all(&half).unwrap();
    let mut reported = Vec::new();
    while reported.len() < 2 {
        reported.extend(steps(&mut server, &mut ports, 1, Duration::ZERO));
    }
    drop(there);
    while reported.len() < 3 {
        reported.extend(steps(&mut server, &mut ports, 1, Duration::ZERO));
    }
    assert!(reported[2].ends_with("gone"), "{reported:?}");
    here.write_all(&rest).unwrap();
    here.set_nonblocking(true).unwrap();
    let (mut decoder, mut heard, mut buffer) = (Decoder::<Downlink>::new(STATION), 0, [0; 65_536]);
    while heard == 0 {
        steps(&mut server, &mut ports, 1, Duration::ZERO);
        match here.read(&mut buffer) {
            Ok(length) => {
                assert!(length > 0);
                decoder.feed(&buffer[..length], |_, message| heard += usize::from(answers(&[message]) > 0));
            }
            Err(error) => assert_eq!(error.kind(), ErrorKind::WouldBlock),
        }
    }
    assert_eq!(decoder.counters().skipped_bytes, 0);
}

/// A client that does not read is disconnected, and blocks nobody.
#[test]
fn a_stream_that_is_not_read_is_closed() {
    let (mut server, mut ports) = (served(1), Ports::open(&free(), 1).unwrap());
    let address = ports.addresses().unwrap()[0].1.unwrap();
    let _deaf = TcpStream::connect(address).unwrap();
    let mut reported = Vec::new();
    while reported.len() < 2 {
        reported.extend(steps(&mut server, &mut ports, 1000, Duration::ZERO));
        assert!(server.now_s() < 3600.0, "{reported:?}");
    }
    assert!(reported[1].ends_with("gone"), "{reported:?}");
}

#[test]
fn a_port_that_is_taken_is_named_with_the_cure() {
    let other = UdpSocket::bind("127.0.0.1:0").unwrap();
    let port = other.local_addr().unwrap().port();
    let refused = Ports::open(&Addresses { udp: port, ..free() }, 1).err().unwrap();
    assert!(refused.starts_with(&format!("UDP port {port} of 127.0.0.1 is taken")), "{refused}");
    assert!(refused.contains("--port 0 for any free port"), "{refused}");
    let refused = Ports::open(&Addresses { udp: 65_535, ..free() }, 2).err().unwrap();
    assert_eq!(refused, "the ports from 65535 on do not suffice for 2 vehicles; choose a lower first port");
}

/// Runs these lines like `sitl serve --lockstep`: only `step` advances time, and the end of the input ends the run.
#[test]
fn in_lockstep_lines_drive_the_clock() {
    let session = |text: &'static str| {
        let (mut server, mut ports) = (served(1), Ports::open(&free(), 1).unwrap());
        let mut reported = Vec::new();
        let (mut lines, stop) = (InputLines::of(Cursor::new(text)), AtomicBool::new(false));
        let end = run(
            &mut server,
            Interfaces { ports: &mut ports, hook: &mut () },
            TimeRate::Lockstep,
            &mut lines,
            &stop,
            |line| reported.push(line.to_owned()),
        );
        (end, server.now_s(), reported)
    };
    let (end, now_s, reported) = session("step 250\nspeed 2\nwind 1 0 0\nstep 50\nnonsense");
    assert_eq!((end, now_s), (RunEnd::Silent, 0.3));
    let wanted = [
        "ok step 250",
        "error speed: with --lockstep, only step moves time; start without this option",
        "ok wind 1 0 0",
        "ok step 50",
        "error \"nonsense\": no such command; help lists the commands",
    ];
    assert_eq!(reported, wanted);
    assert_eq!(session("step 10\nquit\nstep 10"), (RunEnd::Quit, 0.01, vec!["ok step 10".into(), "ok quit".into()]));
    let (end, now_s, _) = session("at 0.1 quit\nstep 1000");
    assert_eq!((end, now_s), (RunEnd::Quit, 0.101));
}

#[test]
fn as_fast_as_possible_it_ends_when_asked_to() {
    let (mut server, mut ports) = (served(1), Ports::open(&free(), 1).unwrap());
    assert_eq!(server.line("at 30 quit").lines, ["ok at 30 quit"]);
    let (mut lines, stop) = (InputLines::of(Cursor::new("step 5")), AtomicBool::new(false));
    let mut reported = Vec::new();
    let end = run(
        &mut server,
        Interfaces { ports: &mut ports, hook: &mut () },
        TimeRate::Times(0.0),
        &mut lines,
        &stop,
        |line| reported.push(line.to_owned()),
    );
    assert_eq!(end, RunEnd::Quit);
    assert!((server.now_s() - 30.001).abs() < 1e-9);
    assert!(
        reported.contains(&"error step: time already runs by itself; start with --lockstep".into()),
        "{reported:?}"
    );
    stop.store(true, std::sync::atomic::Ordering::Relaxed);
    let end = run(
        &mut server,
        Interfaces { ports: &mut ports, hook: &mut () },
        TimeRate::Lockstep,
        &mut lines,
        &stop,
        |_| (),
    );
    assert_eq!(end, RunEnd::Stopped);
}

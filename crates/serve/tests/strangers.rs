//! Unknown clients at the ports: who is heard, who gets telemetry, who is disconnected, and the cost per step.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs, reason = "tests")]

use afbc_mavlink::{
    Address, Decoder, Downlink, Encoder, FRAME_MAX, ReceivedFrame, SIGNED_FRAME_MAX, SetupSigning, SigningKey, Stamp,
    Uplink, VehicleCommand,
};
use afbc_scenario::built_in;
use afbc_serve::{Addresses, Ports, Server, fleet};
use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream, UdpSocket};
use std::time::Duration;

const STATION: Address = Address { system: 255, component: 190 };
const KEY: SigningKey = SigningKey([7; 32]);
const SIGNED_10US: u64 = 37_000_000_000_000;
/// Largest number of peers per protocol, and of bytes read and written in a step, as docs/serve.md says.
const PEERS: usize = 32;
const TAKEN: usize = 16_384;
const WRITTEN: usize = 4096;

struct Served {
    server: Server,
    ports: Ports,
    udp: SocketAddr,
    tcp: SocketAddr,
    now: Duration,
    lines: Vec<String>,
}

impl Served {
    fn new() -> Self {
        let scenario = built_in("mocap").unwrap().read().unwrap();
        let mut server = Server::new(&fleet(&scenario, 1).unwrap(), 1).unwrap();
        server.set_wired(true);
        let addresses =
            Addresses { udp: 0, stations: Vec::new(), companions: Vec::new(), tcp: Some(0), ..Addresses::default() };
        let ports = Ports::open(&addresses, 1).unwrap();
        let (udp, tcp) = ports.addresses().unwrap()[0];
        Served { server, ports, udp, tcp: tcp.unwrap(), now: Duration::ZERO, lines: Vec::new() }
    }

    /// Starts a server whose vehicle has a signing key, so that frames need a signature.
    fn with_key() -> Self {
        let mut served = Self::new();
        served.steps(10);
        let setup = SetupSigning { key: Some(KEY), time_10us: SIGNED_10US };
        served.server.hear(0, 1, &frame(&Uplink::Signing(setup)));
        served.server.forget(0, 1);
        served.steps(10);
        assert!(served.server.vehicles()[0].needs_signatures());
        served
    }

    fn steps(&mut self, milliseconds: u32) {
        for _ in 0..milliseconds {
            let Served { server, ports, lines, now, .. } = self;
            *now += Duration::from_millis(1);
            ports.receive(server, *now, |line| lines.push(line.into()));
            let _ = server.step(|vehicle, bytes| ports.send(vehicle, bytes), |line| lines.push(line.into()));
        }
    }

    /// Runs until `count` lines end with `what`.
    fn steps_until(&mut self, what: &str, count: usize) {
        for _ in 0..60_000 {
            if self.reported(what) >= count {
                return;
            }
            self.steps(1);
        }
        assert_eq!(self.reported(what), count, "{what}: {:?}", self.lines);
    }

    fn reported(&self, what: &str) -> usize {
        self.lines.iter().filter(|line| line.ends_with(what)).count()
    }

    fn connect(&mut self) -> TcpStream {
        let before = self.reported("connected");
        let stream = TcpStream::connect(self.tcp).unwrap();
        stream.set_nonblocking(true).unwrap();
        self.steps_until("connected", before + 1);
        stream
    }

    fn bad_frames(&self) -> u32 {
        let status = self.server.vehicles()[0].status();
        status.split(" bad frames").next().unwrap().rsplit(' ').next().unwrap().parse().unwrap()
    }

    fn is_armed(&self) -> bool {
        self.server.vehicles()[0].report().unwrap().mode.armed()
    }
}

fn frame(message: &Uplink) -> Vec<u8> {
    Encoder::new(STATION).send(message, &mut [0; FRAME_MAX]).to_vec()
}

fn beat() -> Vec<u8> {
    frame(&Uplink::Heartbeat)
}

/// Returns a heartbeat signed with the key, with a time stamp this many 10 us after the key was set.
fn signed_beat(from: Address, later_10us: u64) -> Vec<u8> {
    let stamp = Stamp { link: 3, time_10us: SIGNED_10US + later_10us };
    Encoder::new(from).send_signed(&Uplink::Heartbeat, Some((&KEY, stamp)), &mut [0; SIGNED_FRAME_MAX]).to_vec()
}

fn sockets(count: usize) -> Vec<UdpSocket> {
    let socket = || {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        socket.set_nonblocking(true).unwrap();
        socket
    };
    (0..count).map(|_| socket()).collect()
}

fn read(mut stream: &TcpStream) -> Option<Vec<u8>> {
    let (mut all, mut buffer) = (Vec::new(), vec![0; 1 << 20]);
    loop {
        match stream.read(&mut buffer) {
            Ok(0) => return None,
            Ok(length) => all.extend_from_slice(&buffer[..length]),
            Err(error) if error.kind() == ErrorKind::WouldBlock => return Some(all),
            Err(_) => return None,
        }
    }
}

fn datagrams(socket: &UdpSocket) -> Vec<u8> {
    let (mut all, mut buffer) = (Vec::new(), vec![0; 1 << 16]);
    while let Ok((length, _)) = socket.recv_from(&mut buffer) {
        all.extend_from_slice(&buffer[..length]);
    }
    all
}

/// Returns the number of messages in `bytes`, and how many of them are heartbeats.
fn messages(bytes: &[u8]) -> [usize; 2] {
    let (mut decoder, mut counts) = (Decoder::<Downlink>::new(STATION), [0; 2]);
    decoder.feed_accepted(
        bytes,
        |_: &ReceivedFrame<'_>| true,
        |_, message| {
            counts[0] += 1;
            counts[1] += usize::from(matches!(message, Downlink::Heartbeat { .. }));
        },
    );
    counts
}

/// A browser that is tricked into sending frames sends an HTTP header first; other protocols begin differently, too.
#[test]
fn a_stream_that_begins_as_another_protocol_is_dropped() {
    let commands = [frame(&Uplink::Heartbeat), frame(&Uplink::Command(VehicleCommand::Arm))].concat();
    let heads: [&[u8]; 8] = [
        b"POST / HTTP/1.1\r\nHost: 127.0.0.1:5760\r\nContent-Type: text/plain\r\nContent-Length: 80\r\n\r\n",
        b"GET /",
        b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
        b"\x16\x03\x01\x02\x00\x01\x00",
        b"SSH-2.0-OpenSSH\r\n",
        b"\0",
        b"\r\n",
        b"\x80\xfd",
    ];
    for head in heads {
        let mut served = Served::new();
        served.steps(10_000);
        let mut stream = served.connect();
        stream.write_all(&[head, &commands, &commands].concat()).unwrap();
        served.steps_until("speaks another protocol than MAVLink", 1);
        let _ = stream.write_all(&commands);
        served.steps(1000);
        assert!(!served.is_armed() && served.reported("gone") == 1, "{head:?}: {:?}", served.lines);
        assert!(served.lines.iter().all(|line| !line.contains("arm")), "{head:?}: {:?}", served.lines);
        // The same by UDP.
        let socket = sockets(1).remove(0);
        socket.send_to(&[head, &commands].concat(), served.udp).unwrap();
        served.steps(1000);
        assert!(!served.is_armed() && served.reported("connected") == 1 && datagrams(&socket).is_empty());
    }
    // MAVLink is accepted, also in pieces, and also after a first frame of MAVLink 1.
    for first in [&[][..], &[0xFE, 9, 0, 255, 190, 0, 0, 0, 0, 0, 6, 8, 0, 4, 3, 1, 1]] {
        let mut served = Served::new();
        served.steps(10_000);
        let mut stream = served.connect();
        for piece in [first, &commands].concat().chunks(3) {
            stream.write_all(piece).unwrap();
            served.steps(2);
        }
        served.steps(300);
        assert!(served.is_armed(), "{:?}", served.lines);
    }
}

/// Single bytes, noise and incomplete frames make no client a peer, however many send them.
#[test]
fn only_a_frame_makes_a_peer() {
    let mut served = Served::new();
    let strangers = sockets(3 * PEERS);
    let half = beat()[..9].to_vec();
    let mut damaged = beat();
    *damaged.last_mut().unwrap() ^= 1;
    for (place, stranger) in strangers.iter().enumerate() {
        let sent: &[&[u8]] = &[b"x", b"", &[0xFD], &half, &damaged, &[0xFD; 300], b"\xfd\x09 noise"];
        stranger.send_to(sent[place % sent.len()], served.udp).unwrap();
        served.steps(5);
    }
    served.steps(2000);
    assert_eq!(served.lines, [""; 0]);
    assert!(strangers.iter().all(|stranger| datagrams(stranger).is_empty()));
    assert_eq!(served.server.vehicles()[0].status().split(", ").find(|part| part.ends_with("peers")), Some("0 peers"));
    let station = sockets(1).remove(0);
    station.send_to(&beat(), served.udp).unwrap();
    served.steps(1500);
    assert!(messages(&datagrams(&station))[0] > 10 && served.reported("connected") == 1, "{:?}", served.lines);
}

/// If there are too many peers, the peer that has been silent for longest goes. Bytes that are no valid frame do not
/// count.
#[test]
fn the_longest_silent_peer_goes_first() {
    let mut served = Served::new();
    let peers = sockets(PEERS);
    for peer in &peers {
        peer.send_to(&beat(), served.udp).unwrap();
        served.steps(5);
    }
    // The first peer sends a frame, the second one only noise.
    peers[0].send_to(&beat(), served.udp).unwrap();
    peers[1].send_to(b"here I am", served.udp).unwrap();
    served.steps(5);
    assert_eq!((served.reported("connected"), served.reported("gone")), (PEERS, 0));
    for (place, newcomer) in sockets(3).into_iter().enumerate() {
        newcomer.send_to(&beat(), served.udp).unwrap();
        served.steps(1500);
        assert!(messages(&datagrams(&newcomer))[0] > 10, "{place}");
        let gone = format!("udp {} gone", peers[place + 1].local_addr().unwrap());
        assert_eq!((served.reported(&gone), served.reported("gone")), (1, place + 1), "{:?}", served.lines);
    }
    assert!(messages(&datagrams(&peers[0]))[0] > 10);
}

/// With a key, a client that does not sign is no peer, gets nothing, and locks nobody out.
#[test]
fn with_a_key_only_an_accepted_frame_makes_a_peer() {
    let mut served = Served::with_key();
    let strangers = sockets(2 * PEERS);
    let wrong_key = {
        let stamp = Stamp { link: 3, time_10us: SIGNED_10US + 50 };
        let signer = Some((&SigningKey([8; 32]), stamp));
        Encoder::new(STATION).send_signed(&Uplink::Heartbeat, signer, &mut [0; SIGNED_FRAME_MAX]).to_vec()
    };
    let elsewhere = frame(&Uplink::Command(VehicleCommand::Other(31_999)));
    for (place, stranger) in strangers.iter().enumerate() {
        stranger.send_to([&beat(), &wrong_key, &elsewhere][place % 3], served.udp).unwrap();
        served.steps(3);
    }
    served.steps(1500);
    assert!(served.reported("connected") == 0 && strangers.iter().all(|stranger| datagrams(stranger).is_empty()));
    let holder = sockets(1).remove(0);
    holder.send_to(&signed_beat(STATION, 100), served.udp).unwrap();
    served.steps(1500);
    assert!(messages(&datagrams(&holder))[0] > 10 && served.reported("connected") == 1, "{:?}", served.lines);
    // If another client replays the frame, it is not accepted again.
    strangers[0].send_to(&signed_beat(STATION, 100), served.udp).unwrap();
    served.steps(1500);
    assert!(datagrams(&strangers[0]).is_empty());
}

/// A client that was a peer before the key was set, and does not sign, is dropped after a few seconds.
#[test]
fn a_key_ends_peers_who_do_not_sign() {
    let mut served = Served::new();
    let [other, holder]: [UdpSocket; 2] = sockets(2).try_into().unwrap();
    other.send_to(&beat(), served.udp).unwrap();
    let setup = SetupSigning { key: Some(KEY), time_10us: SIGNED_10US };
    holder.send_to(&frame(&Uplink::Signing(setup)), served.udp).unwrap();
    for second in 1..8 {
        served.steps(1000);
        holder.send_to(&signed_beat(STATION, second * 100_000), served.udp).unwrap();
        other.send_to(&beat(), served.udp).unwrap();
    }
    assert_eq!((served.reported("connected"), served.reported("gone")), (2, 1), "{:?}", served.lines);
    drop((datagrams(&other), datagrams(&holder)));
    served.steps(1500);
    assert!(datagrams(&other).is_empty() && messages(&datagrams(&holder))[0] > 10);
}

/// Silent connections make way for clients that send frames.
#[test]
fn idle_streams_keep_nobody_out() {
    for with_key in [false, true] {
        let mut served = if with_key { Served::with_key() } else { Served::new() };
        let mut station = served.connect();
        station.write_all(&if with_key { signed_beat(STATION, 100) } else { beat() }).unwrap();
        let idle: Vec<TcpStream> = (0..3 * PEERS).map(|_| served.connect()).collect();
        served.steps(1500);
        let open = idle.iter().filter(|stream| read(stream).is_some()).count();
        assert_eq!(open, PEERS - 1, "{:?}", served.lines);
        assert!(read(&station).is_some_and(|bytes| messages(&bytes)[0] > 10), "{:?}", served.lines);
        served.steps(3000);
        // Without a key, everyone gets everything. With a key, clients that have not signed get heartbeats only.
        let got = idle.iter().rev().find_map(read).map(|bytes| messages(&bytes)).unwrap();
        assert!(got[1] > 0 && (got[0] == got[1]) == with_key, "{got:?}");
        // A second client with the key finds a place.
        let mut second = served.connect();
        let other = Address { system: 254, component: 190 };
        second.write_all(&if with_key { signed_beat(other, 100) } else { beat() }).unwrap();
        served.steps(1500);
        assert!(read(&second).is_some_and(|bytes| messages(&bytes)[0] > 10), "{:?}", served.lines);
    }
}

/// A client that starts to read again gets the waiting bytes in parts: each step writes a bounded number, and the rest
/// waits.
#[test]
fn a_reader_who_resumes_gets_a_bounded_part_in_each_step() {
    let mut served = Served::new();
    let mut stream = served.connect();
    stream.write_all(&beat()).unwrap();
    served.steps(10);
    // Send until the system accepts no more and many bytes wait in the server.
    let bytes = beat().repeat(WRITTEN / beat().len());
    let (mut sent, mut got) = (0, read(&stream).unwrap().len());
    for _ in 0..70 {
        served.ports.send(0, &bytes.repeat(4));
        sent += 4 * bytes.len();
    }
    // Read everything that the system holds, without any step in between.
    let mut idle = 0;
    while idle < 100 {
        let part = read(&stream).unwrap().len();
        got += part;
        idle = if part == 0 { idle + 1 } else { 0 };
        std::thread::sleep(Duration::from_millis(1));
    }
    assert!(got < 71 * WRITTEN && got < sent / 2, "{got} of {sent}");
    served.steps(10);
    std::thread::sleep(Duration::from_millis(50));
    let part = read(&stream).unwrap().len();
    assert!(part > 5 * WRITTEN && part <= 10 * WRITTEN, "{part}");
}

/// Bytes that many clients send at once are read in parts, so that no step reads many of them.
#[test]
fn a_flood_is_taken_in_parts() {
    let mut served = Served::new();
    let mut damaged = beat();
    *damaged.last_mut().unwrap() ^= 1;
    let most = 2 * (TAKEN + 65_536) / damaged.len();
    let flood = damaged.repeat(3000);
    let streams: Vec<TcpStream> = (0..8).map(|_| served.connect()).collect();
    streams.iter().for_each(|mut stream| drop(stream.write(&flood)));
    let peers = sockets(8);
    peers.iter().for_each(|peer| drop(peer.send_to(&beat(), served.udp)));
    served.steps(10);
    for peer in &peers {
        (0..40).for_each(|_| drop(peer.send_to(&damaged.repeat(60), served.udp)));
    }
    let (mut before, mut busy) = (served.bad_frames(), 0);
    for _ in 0..500 {
        served.steps(1);
        let now = served.bad_frames();
        assert!(((now - before) as usize) < most, "{} frames in a step", now - before);
        busy += u32::from(now > before);
        before = now;
    }
    assert!(busy > 20 && before > 5000, "{busy} steps, {before} frames");
}

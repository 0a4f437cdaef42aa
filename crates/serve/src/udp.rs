//! A vehicle's UDP port.

use crate::frames::frames;
use crate::peer::{Event, speaks_mavlink};
use std::collections::BTreeMap;
use std::io;
use std::net::{IpAddr, SocketAddr, UdpSocket};
use std::time::Duration;

/// Silence after which a peer is forgotten.
pub(crate) const SILENCE_MAX: Duration = Duration::from_secs(60);
/// Time that is left to peers who have not signed, once there is a key.
const UNSIGNED_MAX: Duration = Duration::from_secs(5);
/// Most peers of a vehicle.
pub(crate) const PEERS_MAX: usize = 32;
/// Most datagrams taken in one step, and bytes after which no further one is, so that a flood does not stop the clock.
const DATAGRAMS_MAX: usize = 128;
const TAKEN_MAX: usize = 16_384;
/// Longest datagram, below what Ethernet carries in one piece.
const DATAGRAM_MAX: usize = 1400;

/// A socket, the addresses that get heartbeats unasked, and whoever has sent a frame that the vehicle takes.
pub(crate) struct Udp {
    socket: UdpSocket,
    standing: Vec<SocketAddr>,
    peers: BTreeMap<SocketAddr, Known>,
    /// True while frames need a signature.
    signed: bool,
    buffer: Vec<u8>,
}

/// A peer.
struct Known {
    number: u32,
    /// When it is forgotten, unless it sends such a frame before.
    until: Duration,
}

impl Udp {
    /// Opens the port `port` of this address.
    ///
    /// # Errors
    /// The system's.
    pub(crate) fn open(address: IpAddr, port: u16, standing: Vec<SocketAddr>) -> io::Result<Self> {
        let socket = UdpSocket::bind((address, port))?;
        socket.set_nonblocking(true)?;
        Ok(Udp { socket, standing, peers: BTreeMap::new(), signed: false, buffer: vec![0; 65_536] })
    }

    pub(crate) fn address(&self) -> io::Result<SocketAddr> {
        self.socket.local_addr()
    }

    /// Receives what has arrived by `now`. Frames need a signature if `signed`. `number` gives a new peer its number;
    /// `on` tells of what was [sent](Event::Sent) whether the vehicle takes a frame of it.
    pub(crate) fn receive(
        &mut self,
        (now, signed): (Duration, bool),
        number: &mut impl FnMut() -> u32,
        mut on: impl FnMut(Event<'_>) -> bool,
    ) {
        if signed && !self.signed {
            // Whoever does not sign is not heard any more, and gets nothing for long.
            self.peers.values_mut().for_each(|known| known.until = known.until.min(now + UNSIGNED_MAX));
        }
        self.signed = signed;
        let (mut buffer, mut taken) = (std::mem::take(&mut self.buffer), 0);
        for _ in 0..DATAGRAMS_MAX {
            // Errors are reports that a peer of an earlier datagram does not listen, or that nothing has arrived.
            let (length, from) = match self.socket.recv_from(&mut buffer) {
                Ok(received) => received,
                Err(error) if error.kind() == io::ErrorKind::ConnectionReset => continue,
                Err(_) => break,
            };
            self.take((from, buffer.get(..length).unwrap_or_default()), now, number, &mut on);
            taken += length;
            if taken >= TAKEN_MAX {
                break;
            }
        }
        self.buffer = buffer;
        self.peers.retain(|address, known| {
            let here = now <= known.until;
            if !here {
                on(Event::Gone(*address, known.number));
            }
            here
        });
    }

    /// Takes a datagram. Who is no peer yet becomes one by a frame that the vehicle takes, instead of the peer that has
    /// been silent for longest if there are too many.
    fn take(
        &mut self,
        (from, bytes): (SocketAddr, &[u8]),
        now: Duration,
        number: &mut impl FnMut() -> u32,
        on: &mut impl FnMut(Event<'_>) -> bool,
    ) {
        if let Some(known) = self.peers.get_mut(&from) {
            if on(Event::Sent(known.number, bytes)) {
                known.until = now + SILENCE_MAX;
            }
            return;
        }
        if !speaks_mavlink(bytes) {
            return;
        }
        let number = number();
        if !on(Event::Sent(number, bytes)) {
            on(Event::Nobody(number));
            return;
        }
        let longest = self.peers.iter().min_by_key(|(_, known)| known.until).map(|(address, _)| *address);
        if self.peers.len() >= PEERS_MAX
            && let Some((address, known)) = longest.and_then(|address| self.peers.remove_entry(&address))
        {
            on(Event::Gone(address, known.number));
        }
        self.peers.insert(from, Known { number, until: now + SILENCE_MAX });
        on(Event::New(from));
    }

    /// Sends whole frames: all of them to the peers, heartbeats to the standing addresses too. A
    /// datagram holds as many as fit.
    pub(crate) fn send(&self, bytes: &[u8]) {
        if bytes.is_empty() {
            return;
        }
        for datagram in datagrams(bytes) {
            for peer in self.peers.keys() {
                // Nobody may be there; telemetry is not repeated.
                let _ = self.socket.send_to(datagram, peer);
            }
        }
        for frame in frames(bytes).filter(|frame| frame.is_heartbeat()) {
            // A peer has had them already, with everything else.
            for address in self.standing.iter().filter(|address| !self.peers.contains_key(*address)) {
                let _ = self.socket.send_to(frame.bytes(), address);
            }
        }
    }
}

/// Cuts `bytes` between frames.
fn datagrams(bytes: &[u8]) -> Vec<&[u8]> {
    let (mut all, mut rest, mut length) = (Vec::new(), bytes, 0);
    for frame in frames(bytes) {
        if length + frame.bytes().len() > DATAGRAM_MAX
            && let Some((full, left)) = rest.split_at_checked(length)
        {
            all.push(full);
            (rest, length) = (left, 0);
        }
        length += frame.bytes().len();
    }
    all.extend(rest.get(..length));
    all
}

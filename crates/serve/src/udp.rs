//! UDP port of a vehicle.

use crate::frames::frames;
use crate::peer::{PeerEvent, speaks_mavlink};
use std::collections::BTreeMap;
use std::io;
use std::net::{IpAddr, SocketAddr, UdpSocket};
use std::time::Duration;

/// Silence after which a peer is forgotten.
pub(crate) const SILENCE_MAX: Duration = Duration::from_secs(60);
/// Time after which unsigned peers are forgotten once a signing key is set.
const UNSIGNED_MAX: Duration = Duration::from_secs(5);
/// Largest number of peers of a vehicle.
pub(crate) const PEERS_MAX: usize = 32;
/// Largest number of datagrams read in one step, and number of bytes after which reading stops, so that a flood does
/// not stop time.
const DATAGRAMS_MAX: usize = 128;
const TAKEN_MAX: usize = 16_384;
/// Longest datagram \[bytes\], small enough for one Ethernet packet.
const DATAGRAM_MAX: usize = 1400;

/// A socket, the standing addresses that always get heartbeats, and the peers: clients that have sent a valid frame.
pub(crate) struct UdpPort {
    socket: UdpSocket,
    standing: Vec<SocketAddr>,
    peers: BTreeMap<SocketAddr, UdpPeer>,
    /// True if frames need a signature.
    signed: bool,
    buffer: Vec<u8>,
}

/// A peer.
struct UdpPeer {
    number: u32,
    /// Time when the peer is forgotten, unless it sends a valid frame before.
    until: Duration,
}

impl UdpPort {
    /// Opens port `port` of this address.
    ///
    /// # Errors
    /// Fails with the system's error.
    pub(crate) fn open(address: IpAddr, port: u16, standing: Vec<SocketAddr>) -> io::Result<Self> {
        let socket = UdpSocket::bind((address, port))?;
        socket.set_nonblocking(true)?;
        Ok(UdpPort { socket, standing, peers: BTreeMap::new(), signed: false, buffer: vec![0; 65_536] })
    }

    pub(crate) fn address(&self) -> io::Result<SocketAddr> {
        self.socket.local_addr()
    }

    /// Reads the datagrams that have arrived by `now`. If `signed`, frames need a signature. `number` returns the
    /// number of a new peer. `on` handles events; for [`PeerEvent::Sent`] it returns whether the bytes complete a valid
    /// frame.
    pub(crate) fn receive(
        &mut self,
        (now, signed): (Duration, bool),
        number: &mut impl FnMut() -> u32,
        mut on: impl FnMut(PeerEvent<'_>) -> bool,
    ) {
        if signed && !self.signed {
            // Peers that do not sign are no longer heard, and soon get no telemetry.
            self.peers.values_mut().for_each(|known| known.until = known.until.min(now + UNSIGNED_MAX));
        }
        self.signed = signed;
        let (mut buffer, mut taken) = (std::mem::take(&mut self.buffer), 0);
        for _ in 0..DATAGRAMS_MAX {
            // An error means that a peer of an earlier datagram does not listen, or that nothing has arrived.
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
                on(PeerEvent::Gone(*address, known.number));
            }
            here
        });
    }

    /// Handles a datagram. An unknown sender becomes a peer when it sends a valid frame. If there are too many peers,
    /// the new peer replaces the peer that has been silent for longest.
    fn take(
        &mut self,
        (from, bytes): (SocketAddr, &[u8]),
        now: Duration,
        number: &mut impl FnMut() -> u32,
        on: &mut impl FnMut(PeerEvent<'_>) -> bool,
    ) {
        if let Some(known) = self.peers.get_mut(&from) {
            if on(PeerEvent::Sent(known.number, bytes)) {
                known.until = now + SILENCE_MAX;
            }
            return;
        }
        if !speaks_mavlink(bytes) {
            return;
        }
        let number = number();
        if !on(PeerEvent::Sent(number, bytes)) {
            on(PeerEvent::Nobody(number));
            return;
        }
        let longest = self.peers.iter().min_by_key(|(_, known)| known.until).map(|(address, _)| *address);
        if self.peers.len() >= PEERS_MAX
            && let Some((address, known)) = longest.and_then(|address| self.peers.remove_entry(&address))
        {
            on(PeerEvent::Gone(address, known.number));
        }
        self.peers.insert(from, UdpPeer { number, until: now + SILENCE_MAX });
        on(PeerEvent::New(from));
    }

    /// Sends complete frames: all frames to the peers, and heartbeats to the standing addresses. A datagram holds as
    /// many frames as fit.
    pub(crate) fn send(&self, bytes: &[u8]) {
        if bytes.is_empty() {
            return;
        }
        for datagram in datagrams(bytes) {
            for peer in self.peers.keys() {
                // Errors are ignored: nobody may be listening, and telemetry is not repeated.
                let _ = self.socket.send_to(datagram, peer);
            }
        }
        for frame in frames(bytes).filter(|frame| frame.is_heartbeat()) {
            // Peers have already got the heartbeats with all other frames.
            for address in self.standing.iter().filter(|address| !self.peers.contains_key(*address)) {
                let _ = self.socket.send_to(frame.bytes(), address);
            }
        }
    }
}

/// Splits `bytes` into datagrams of complete frames.
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

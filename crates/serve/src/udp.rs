//! A vehicle's UDP port.

use crate::frames::frames;
use crate::peer::Event;
use std::collections::BTreeMap;
use std::io;
use std::net::{IpAddr, SocketAddr, UdpSocket};
use std::time::Duration;

/// Silence after which a peer is forgotten.
pub(crate) const SILENCE_MAX: Duration = Duration::from_secs(60);
/// Most peers of a vehicle; further ones are not heard.
pub(crate) const PEERS_MAX: usize = 32;
/// Most datagrams taken in one step, so that a flood does not stop the clock.
const TAKEN_MAX: usize = 256;
/// Longest datagram, below what Ethernet carries in one piece.
const DATAGRAM_MAX: usize = 1400;

/// A socket, the addresses that get heartbeats unasked, and whoever has sent something.
pub(crate) struct Udp {
    socket: UdpSocket,
    standing: Vec<SocketAddr>,
    peers: BTreeMap<SocketAddr, Known>,
}

/// A peer.
struct Known {
    number: u32,
    heard: Duration,
}

impl Udp {
    /// Opens the port `port` of this address.
    ///
    /// # Errors
    /// The system's.
    pub(crate) fn open(address: IpAddr, port: u16, standing: Vec<SocketAddr>) -> io::Result<Self> {
        let socket = UdpSocket::bind((address, port))?;
        socket.set_nonblocking(true)?;
        Ok(Udp { socket, standing, peers: BTreeMap::new() })
    }

    pub(crate) fn address(&self) -> io::Result<SocketAddr> {
        self.socket.local_addr()
    }

    /// Receives what has arrived by `now`. `number` gives a new peer its number.
    pub(crate) fn receive(&mut self, now: Duration, number: &mut impl FnMut() -> u32, mut on: impl FnMut(Event<'_>)) {
        let mut buffer = [0; 65_536];
        for _ in 0..TAKEN_MAX {
            // Errors are reports that a peer of an earlier datagram does not listen, or that nothing has arrived.
            let (length, from) = match self.socket.recv_from(&mut buffer) {
                Ok(received) => received,
                Err(error) if error.kind() == io::ErrorKind::ConnectionReset => continue,
                Err(_) => break,
            };
            if !self.peers.contains_key(&from) {
                if self.peers.len() >= PEERS_MAX {
                    continue;
                }
                self.peers.insert(from, Known { number: number(), heard: now });
                on(Event::New(from));
            }
            if let Some(known) = self.peers.get_mut(&from) {
                known.heard = now;
                on(Event::Sent(known.number, buffer.get(..length).unwrap_or_default()));
            }
        }
        self.peers.retain(|address, known| {
            let here = now.saturating_sub(known.heard) <= SILENCE_MAX;
            if !here {
                on(Event::Gone(*address, known.number));
            }
            here
        });
    }

    /// Sends whole frames: all of them to whoever has sent something, heartbeats to the standing addresses too. A
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

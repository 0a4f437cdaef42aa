//! Events of a vehicle's peers: the clients on its ports.

use std::net::SocketAddr;

/// First byte of a MAVLink 2 frame, and of a MAVLink 1 frame, which old stations send first.
const STARTS: [u8; 2] = [0xFD, 0xFE];

/// An event of a peer.
pub(crate) enum PeerEvent<'a> {
    /// A new peer.
    New(SocketAddr),
    /// The peer with this number has sent these bytes. The handler returns whether they complete a valid frame.
    Sent(u32, &'a [u8]),
    /// The sender with this number has sent nothing valid, and does not become a peer.
    Nobody(u32),
    /// A peer began with another protocol and is disconnected.
    Foreign(SocketAddr),
    /// The peer is gone: its stream has ended, it was silent for too long, or a new peer has taken its place.
    Gone(SocketAddr, u32),
}

/// Returns true if the first bytes of a peer may be MAVLink. A browser that is tricked into sending frames sends an
/// HTTP header first.
pub(crate) fn speaks_mavlink(first: &[u8]) -> bool {
    first.first().is_some_and(|byte| STARTS.contains(byte))
}

//! What happens to the peers of a vehicle.

use std::net::SocketAddr;

/// First byte of a frame of MAVLink 2, and of MAVLink 1, which old stations begin with.
const STARTS: [u8; 2] = [0xFD, 0xFE];

/// What has happened to a peer.
pub(crate) enum Event<'a> {
    /// It is new.
    New(SocketAddr),
    /// The one of this number has sent this. The answer is whether that contains a frame that the vehicle takes.
    Sent(u32, &'a [u8]),
    /// What the one of this number has sent came to nothing.
    Nobody(u32),
    /// It has begun with another protocol, and is let go.
    Foreign(SocketAddr),
    /// It is gone: its stream has ended, it has been silent for too long, or others have taken its place.
    Gone(SocketAddr, u32),
}

/// True if what a peer sends first may be MAVLink. A browser that is made to send frames sends the head of a request
/// before them.
pub(crate) fn speaks_mavlink(first: &[u8]) -> bool {
    first.first().is_some_and(|byte| STARTS.contains(byte))
}

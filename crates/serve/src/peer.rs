//! What happens to the peers of a vehicle.

use std::net::SocketAddr;

/// What has happened to a peer.
pub(crate) enum Event<'a> {
    /// It is new.
    New(SocketAddr),
    /// The one of this number has sent this.
    Sent(u32, &'a [u8]),
    /// It is gone: its stream has ended, or it has been silent for too long.
    Gone(SocketAddr, u32),
}

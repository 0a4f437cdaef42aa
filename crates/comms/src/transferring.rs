//! Interfaces of services that transfer files and logs.

use afbc_mavlink::{Address, MessageSet, Uplink};

/// Takes requests for files and logs. `()` takes none, so that they are refused.
pub trait TransferRequests {
    /// Returns true if the message is a request for files or logs.
    fn wants(&self, message: &Uplink) -> bool;

    /// Takes a message that is [wanted](Self::wants). `may_change` is false if the station may not change anything.
    /// Returns false if the queue is full.
    fn take(&mut self, from: Address, message: &Uplink, payload: &[u8], may_change: bool) -> bool;
}

impl TransferRequests for () {
    fn wants(&self, _: &Uplink) -> bool {
        false
    }

    fn take(&mut self, _: Address, _: &Uplink, _: &[u8], _: bool) -> bool {
        false
    }
}

/// Transfers files and logs between a storage and the link.
pub(crate) trait Transferring {
    /// Type of the messages that are sent.
    type Sent: MessageSet;

    /// Returns the length of the longest frame that may be next \[bytes\].
    fn frame_max(&self) -> usize;

    /// Returns the next message or text at `now_us` since power-up. Returns none if there is nothing to send now.
    fn next(&mut self, now_us: u64, armed: bool) -> Option<Outcome<Self::Sent>>;
}

/// A message or a text to send.
#[allow(clippy::large_enum_variant, reason = "only one exists at a time, on the sender's stack")]
pub(crate) enum Outcome<M> {
    Send(M),
    /// Text for all stations; true for a warning.
    Say(&'static str, bool),
}

//! What takes requests for files and logs, and goes on with them.

use afbc_link::{Address, Message, Uplink};

/// Takes requests for files and logs out of what stations send. `()` takes none: they are refused.
pub trait TransferRequests {
    /// True if the message is one.
    fn wants(&self, message: &Uplink) -> bool;

    /// Takes a message that it [wants](Self::wants); `may_change` is false if the station may not change anything.
    /// False if too many wait.
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

/// What transfers, over some storage.
pub(crate) trait Transferring {
    /// What it sends.
    type Sent: Message;

    /// Returns the longest frame that may be next \[bytes\].
    fn frame_max(&self) -> usize;

    /// Returns what is to be done next, at this time since power-up; none if there is nothing now.
    fn next(&mut self, now_us: u64, armed: bool) -> Option<Outcome<Self::Sent>>;
}

/// What is to be sent or said.
#[allow(clippy::large_enum_variant, reason = "one at a time, on the stack of whoever sends it")]
pub(crate) enum Outcome<M> {
    Send(M),
    /// To everyone, as a warning if it is one.
    Say(&'static str, bool),
}

//! Addresses of senders and receivers.

/// MAVLink address of a sender or a receiver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Address {
    /// MAVLink system id; 0 means all.
    pub system: u8,
    /// MAVLink component id; 0 means all.
    pub component: u8,
}

impl Address {
    /// True if a message to `target` is meant for this address.
    pub fn is_meant_by(self, target: Address) -> bool {
        (target.system == 0 || target.system == self.system)
            && (target.component == 0 || target.component == self.component)
    }
}

//! The share of the link that is guaranteed to transfers of files and logs.

/// Transfers get at least 1 / `SHARE` of the link's bytes, even if telemetry needs all of it. They also get all bytes
/// that telemetry leaves.
const SHARE: i64 = 5;
/// Largest number of bytes that transfers can save up for later, less than a frame \[1e-3 bytes\].
const SAVED: i64 = 250_000;

/// Number of bytes that transfers may send.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LinkShare {
    /// Bytes that may be sent now \[1e-3 bytes\].
    saved: i64,
}

impl LinkShare {
    pub(crate) const NEW: Self = LinkShare { saved: SAVED };

    /// Adds the share of one tick of 1 ms on a link of `bytes_per_s`.
    pub(crate) fn tick(&mut self, bytes_per_s: u32) {
        // Bytes per second are thousandths of bytes per millisecond.
        self.saved = (self.saved + i64::from(bytes_per_s) / SHARE).min(SAVED);
    }

    /// Returns true if a frame may be sent.
    pub(crate) fn has_room(&self) -> bool {
        self.saved > 0
    }

    /// Subtracts sent bytes from the budget.
    pub(crate) fn spend(&mut self, bytes: usize) {
        self.saved = self.saved.saturating_sub(1000 * bytes as i64).max(-SAVED);
    }
}

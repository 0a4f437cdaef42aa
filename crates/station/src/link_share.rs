//! What files and logs get of the link that telemetry and commands share.

/// Part of the link that transfers get even when telemetry takes all of it: one in so many bytes. What telemetry
/// leaves, they get anyway.
const SHARE: i64 = 5;
/// Bytes of that part that may be saved up: less than a frame \[1e-3 bytes\].
const SAVED: i64 = 250_000;

/// What transfers may send of their own part.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LinkShare {
    /// \[1e-3 bytes\]
    saved: i64,
}

impl LinkShare {
    pub(crate) const NEW: Self = LinkShare { saved: SAVED };

    /// Begins a tick on a link of so many bytes per second.
    pub(crate) fn tick(&mut self, bytes_per_s: u32) {
        // Bytes per second are thousandths of bytes per millisecond.
        self.saved = (self.saved + i64::from(bytes_per_s) / SHARE).min(SAVED);
    }

    /// True if there is room.
    pub(crate) fn has_room(&self) -> bool {
        self.saved > 0
    }

    /// Notes that so many bytes were sent.
    pub(crate) fn spend(&mut self, bytes: usize) {
        self.saved = self.saved.saturating_sub(1000 * bytes as i64).max(-SAVED);
    }
}

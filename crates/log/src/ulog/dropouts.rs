//! Logs the time for which records are missing.

use crate::ulog::ring::RingView;

/// Longest time in one dropout record \[ms\].
const LONGEST_MS: u64 = u16::MAX as u64;

/// Measures dropouts, and logs them once there is room again.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Dropouts {
    /// Start of the present dropout \[us\].
    since_us: Option<u64>,
    /// Ended dropouts that are not logged yet, less than a millisecond unless the ring is full \[us\].
    owed_us: u64,
}

impl Dropouts {
    /// Writes a record by `write`, after any dropout before it. Returns false if the record did not fit. Then all other
    /// records with the same time are dropped, too.
    #[inline(never)]
    pub(crate) fn put(
        &mut self,
        now_us: u64,
        ring: &mut RingView<'_>,
        write: &mut dyn FnMut(&mut RingView<'_>) -> bool,
    ) -> bool {
        let fits = self.since_us != Some(now_us) && self.settle(now_us, ring) && write(ring);
        if !fits {
            self.since_us = Some(now_us);
        }
        fits
    }

    /// Begins a dropout at a time. It ends at the next written record.
    pub(crate) fn miss(&mut self, since_us: u64) {
        self.since_us.get_or_insert(since_us);
    }

    /// Logs the ended dropouts. Returns false if there is no room.
    fn settle(&mut self, now_us: u64, ring: &mut RingView<'_>) -> bool {
        let missed_us = self.since_us.take().map_or(0, |since_us| now_us.saturating_sub(since_us));
        self.owed_us = self.owed_us.saturating_add(missed_us);
        while self.owed_us >= 1000 {
            // A dropout record has 16 bits for the time; a longer dropout takes several records.
            let ms = (self.owed_us / 1000).min(LONGEST_MS);
            if !ring.record(b'O', &mut |content| content.put(&(ms as u16).to_le_bytes())) {
                return false;
            }
            self.owed_us -= 1000 * ms;
        }
        true
    }
}

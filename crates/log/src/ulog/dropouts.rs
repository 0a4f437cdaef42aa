//! Time for which records are missing.

use crate::ulog::ring::RingView;

/// Longest dropout of one record \[ms\].
const LONGEST_MS: u64 = u16::MAX as u64;

/// Counts it, and writes it once there is room again.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Dropouts {
    /// Since when records are missing \[us\].
    since_us: Option<u64>,
    /// What is over and not written, less than a millisecond unless the ring is full \[us\].
    owed_us: u64,
}

impl Dropouts {
    /// Writes a record by `write`, after the dropout before it; false if it is missing. Once one does not fit, all
    /// others of the same time are missing, too.
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

    /// Notes that records are missing from a time on, until one is written.
    pub(crate) fn miss(&mut self, since_us: u64) {
        self.since_us.get_or_insert(since_us);
    }

    /// Writes what is over; false if there is no room.
    fn settle(&mut self, now_us: u64, ring: &mut RingView<'_>) -> bool {
        let missed_us = self.since_us.take().map_or(0, |since_us| now_us.saturating_sub(since_us));
        self.owed_us = self.owed_us.saturating_add(missed_us);
        while self.owed_us >= 1000 {
            // The record has 16 bits for it: a longer one becomes several.
            let ms = (self.owed_us / 1000).min(LONGEST_MS);
            if !ring.record(b'O', &mut |content| content.put(&(ms as u16).to_le_bytes())) {
                return false;
            }
            self.owed_us -= 1000 * ms;
        }
        true
    }
}

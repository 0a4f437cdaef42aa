//! Rows that are known to be late in the worst case, with their largest response and the reason for accepting it.

use core::fmt::{Display, Formatter, Result};

/// A row that may be late in the worst case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KnownLateness {
    /// Name of the row.
    pub row: &'static str,
    /// Largest accepted response \[us\]; none if the response has no bound.
    pub most_us: Option<u64>,
    /// True if the row is late even if every fetch hits the cache.
    pub at_best: bool,
    /// Reason for accepting the lateness.
    pub reason: &'static str,
}

const LINKS: &str = "every serial line is full in both directions, and every fetch of every task misses the cache. The \
     board then reports no results of ticks; no task of higher priority waits for this one";

const FULL: &str = "every fetch of every task misses the cache while two links are full in both directions. With \
     `SER_TEL1_BAUD` = 230400 the task is in time";
const LATE_LINKS: KnownLateness = late("links' task", None, LINKS);

const fn late(row: &'static str, most_us: Option<u64>, reason: &'static str) -> KnownLateness {
    KnownLateness { row, most_us, at_best: false, reason }
}

/// Known lateness of every board but the Pixracer.
pub(super) static COMMON: [KnownLateness; 1] = [LATE_LINKS];

/// Known lateness of the Pixracer, which has two links and three parts on one SPI.
pub(super) static PIXRACER: [KnownLateness; 4] = [
    late("control tick, with the motors' frames", None, FULL),
    late("end of the motors' DMA", None, FULL),
    late("slow sensors, with their transfers", None, FULL),
    LATE_LINKS,
];

impl Display for KnownLateness {
    fn fmt(&self, to: &mut Formatter<'_>) -> Result {
        match self.most_us {
            Some(most_us) => write!(to, "| {} | {most_us} us | {} |", self.row, self.reason),
            None => write!(to, "| {} | none | {} |", self.row, self.reason),
        }
    }
}

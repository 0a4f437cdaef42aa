//! Rows that are known to be late in the worst case, how late at most, and why that is borne.

use core::fmt::{Display, Formatter, Result};

/// A row that may be late in the worst case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KnownLateness {
    /// The row's name.
    pub row: &'static str,
    /// Its response at most \[us\]; none if it has no bound.
    pub most_us: Option<u64>,
    /// True if it is late with every fetch a hit, too.
    pub at_best: bool,
    /// Why that is borne.
    pub reason: &'static str,
}

const LINKS: &str = "every line full in both directions, and no fetch of any task a hit. Results of ticks are not \
     reported then; nothing above this task waits for it";

const FULL: &str = "no fetch of any task a hit, while two links are full in both directions. With `SER_TEL1_BAUD` = \
     230400 it is in time";
const LATE_LINKS: KnownLateness = late("links' task", None, LINKS);

const fn late(row: &'static str, most_us: Option<u64>, reason: &'static str) -> KnownLateness {
    KnownLateness { row, most_us, at_best: false, reason }
}

/// Of every board but the Pixracer.
pub(super) static COMMON: [KnownLateness; 1] = [LATE_LINKS];

/// Of the Pixracer, with two links and three parts on one SPI.
pub(super) static PIXRACER: [KnownLateness; 4] = [
    late("control tick, to the motors' DMA", None, FULL),
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

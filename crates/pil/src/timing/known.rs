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

const BYTE: &str = "the UART keeps one byte. A frame that lacks a byte is dropped by its checksum and counted by the \
     health array; commands and parameters are sent again. `SER_TEL1_BAUD` = 460800 is slow enough";
const LINKS: &str = "every line full in both directions, and no fetch of any task a hit. Results of ticks are not \
     reported then; nothing above this task waits for it";
const BYTE_OF_TWO: &str = "as on the other boards, with two links full in both directions at once";
const FULL: &str = "no fetch of any task a hit, in the same period in which two links are full in both directions. \
     With `SER_TEL1_BAUD` = 460800 it is in time";
const BELOW: &str = "as for the sampling, which is above it";

const fn late(row: &'static str, most_us: Option<u64>, reason: &'static str) -> KnownLateness {
    KnownLateness { row, most_us, at_best: false, reason }
}

/// Of the bare STM32F405.
pub(super) static STM32F405: [KnownLateness; 2] =
    [late("first link: byte received", Some(16), BYTE), late("links' task", None, LINKS)];

/// Of the flight controllers with an STM32F405.
pub(super) static FLIGHT_CONTROLLERS: [KnownLateness; 2] =
    [late("first link: byte received", Some(18), BYTE), late("links' task", None, LINKS)];

/// Of the Pixracer.
pub(super) static PIXRACER: [KnownLateness; 7] = [
    KnownLateness { at_best: true, ..late("first link: byte received", Some(30), BYTE_OF_TWO) },
    KnownLateness { at_best: true, ..late("second link: byte received", Some(30), BYTE_OF_TWO) },
    late("sampling, with its transfers", Some(1100), FULL),
    late("control tick, to the motors' DMA", None, BELOW),
    late("end of the motors' DMA", None, BELOW),
    late("slow sensors, with their transfers", None, BELOW),
    KnownLateness { at_best: true, ..late("links' task", None, LINKS) },
];

/// Of the STM32H743.
pub(super) static STM32H743: [KnownLateness; 1] = [late("links' task", None, LINKS)];

impl Display for KnownLateness {
    fn fmt(&self, to: &mut Formatter<'_>) -> Result {
        match self.most_us {
            Some(most_us) => write!(to, "| {} | {most_us} us | {} |", self.row, self.reason),
            None => write!(to, "| {} | none | {} |", self.row, self.reason),
        }
    }
}

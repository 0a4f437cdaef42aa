//! Rows that are known to be late in the worst case, how late at most, and why that is borne.

use super::work::TimingRow;
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
pub(super) static STM32F405: [KnownLateness; 1] = [late("first link: byte received", Some(16), BYTE)];

/// Of the flight controllers with an STM32F405.
pub(super) static FLIGHT_CONTROLLERS: [KnownLateness; 2] =
    [late("first link: byte received", Some(18), BYTE), late("links' task", None, LINKS)];

/// Of the Pixracer.
pub(super) static PIXRACER: [KnownLateness; 7] = [
    KnownLateness { at_best: true, ..late("first link: byte received", Some(30), BYTE_OF_TWO) },
    KnownLateness { at_best: true, ..late("second link: byte received", Some(30), BYTE_OF_TWO) },
    late("sampling, with its transfers", Some(1_100), FULL),
    late("control tick, to the motors' DMA", None, BELOW),
    late("end of the motors' DMA", None, BELOW),
    late("slow sensors, with their transfers", None, BELOW),
    late("links' task", None, LINKS),
];

/// Of the STM32H743.
pub(super) static STM32H743: [KnownLateness; 1] = [late("links' task", None, LINKS)];

/// Returns a line on each row that is late without being known, later than known, or known and in time.
#[must_use]
pub fn verdicts(known: &[KnownLateness], best: &[TimingRow], bound: &[TimingRow]) -> Vec<String> {
    let mut wrong = Vec::new();
    for (best, bound) in best.iter().zip(bound) {
        let name = bound.name;
        match (bound.is_late(), known.iter().find(|known| known.row == name)) {
            (false, None) => (),
            (false, Some(_)) => wrong.push(format!("{name}: known to be late, and is in time: delete that")),
            (true, None) => wrong.push(format!("{name}: over its deadline")),
            (true, Some(known)) => {
                // Without a bound it is later than any.
                let is_later = known
                    .most_us
                    .is_some_and(|most_us| bound.response_ns.is_none_or(|response_ns| response_ns > 1000 * most_us));
                if is_later {
                    wrong.push(format!("{name}: later than is known"));
                }
                if best.is_late() && !known.at_best {
                    wrong.push(format!("{name}: over its deadline at best, too"));
                }
            }
        }
    }
    let rows = |known: &&KnownLateness| bound.iter().all(|row| row.name != known.row);
    wrong.extend(known.iter().filter(rows).map(|known| format!("{}: known to be late, and no row", known.row)));
    wrong
}

impl Display for KnownLateness {
    fn fmt(&self, to: &mut Formatter<'_>) -> Result {
        match self.most_us {
            Some(most_us) => write!(to, "| {} | {most_us} us | {} |", self.row, self.reason),
            None => write!(to, "| {} | none | {} |", self.row, self.reason),
        }
    }
}

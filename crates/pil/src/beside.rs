//! What else runs in a control period of the `flight` image, counted instruction by instruction under the debugger.

use crate::budget::Linked;
use crate::exercise::motion;
use crate::{Board, Error};
use afbc_link::Uplink;
use afbc_sim::in_the_loop::Station;
use std::path::Path;
use std::time::Duration;

/// How long to wait for each of them.
const PATIENCE: Duration = Duration::from_secs(60);
/// Bytes that a line of 921,600 baud carries in a control period.
const BYTES_PER_PERIOD: f64 = 92.16;
/// Bytes that wake the link's task (`boards/stm32f405/src/board.rs`).
const BYTES_PER_WAKE: f64 = 32.0;

/// Instructions, the most of some counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Beside {
    /// One frame for each of four motors.
    pub dshot: u32,
    /// The time base's interrupt, with the control tick to wake.
    pub systick: u32,
    /// USART1's interrupt: a byte in, or one out, or both.
    pub byte: u32,
    /// The link's task, woken once: bytes to read, or a tick to report, or both.
    pub wake: u32,
}

impl Beside {
    /// Counts, while states come in.
    ///
    /// # Errors
    /// If QEMU or the image is missing, or the image does not come to what is counted.
    pub fn count(elf: &Path) -> Result<Self, Error> {
        let linked = Linked::read(elf)?;
        let address = |name: &str| {
            linked.function_named(name).ok_or_else(|| Error::Protocol(format!("the image has no function {name}")))
        };
        let [encode, systick, byte, wake] =
            [address("flight::board::encode")?, address("SysTick")?, address("USART1")?, address("CAN2_RX0")?];
        let mut board = Board::boot(elf)?;
        let mut station = Station::default();
        for count in 1..=50_u32 {
            let (state, _) = motion(count as f32);
            station.say(&Uplink::State { sent_us: u64::from(count), state });
        }
        board.send(&station.take())?;
        let gdb = board.halt()?;
        gdb.run_to(encode, PATIENCE)?;
        let dshot = gdb.count_function()?;
        // Few in a row: an instruction takes the debugger longer than a control period takes the processor.
        let mut most = |interrupt: u32, samples: u32| -> Result<u32, Error> {
            let mut most = 0;
            for _ in 0..samples {
                gdb.run_to(interrupt, PATIENCE)?;
                most = most.max(gdb.count_exception()?);
            }
            Ok(most)
        };
        Ok(Beside { dshot, systick: most(systick, 4)?, byte: most(byte, 12)?, wake: most(wake, 4)? })
    }

    /// The link's share of a control period on a line that never pauses, in both directions at once: interrupts for every
    /// byte, wakes for every 32 bytes and one for the tick.
    pub fn link_per_period(&self) -> u32 {
        let wakes = BYTES_PER_PERIOD / BYTES_PER_WAKE + 1.0;
        (2.0 * BYTES_PER_PERIOD * f64::from(self.byte) + wakes * f64::from(self.wake)) as u32
    }
}

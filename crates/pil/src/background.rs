//! Counts, in the debugger, the instructions of all code that runs alongside the control tick of the `flight` image.

use crate::budget::LinkedImage;
use crate::exercise::motion;
use crate::{EmulatedBoard, Error};
use afbc_hil::Station;
use std::path::Path;
use std::time::Duration;

/// Longest wait until a counted function runs.
const PATIENCE: Duration = Duration::from_secs(60);

/// Instruction counts, each the largest of a few samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BackgroundInstructions {
    /// Encoding of a DSHOT frame for each of four motors.
    pub dshot: u32,
    /// SysTick's interrupt when it wakes the control tick.
    pub systick: u32,
    /// USART1's interrupt for a received byte, a sent byte, or both.
    pub byte: u32,
    /// One run of the links' task: with bytes to read, a tick to report, or both.
    pub wake: u32,
}

impl BackgroundInstructions {
    /// Counts the instructions while the board receives states.
    ///
    /// # Errors
    /// Fails if QEMU or the image is missing, or if the image does not reach a function to be counted.
    pub fn count(elf: &Path) -> Result<Self, Error> {
        let linked = LinkedImage::read(elf)?;
        let address = |name: &str| {
            linked.function_named(name).ok_or_else(|| Error::Protocol(format!("the image has no function {name}")))
        };
        let [encode, systick, byte, wake] =
            [address("chip_stm32::motors::encode")?, address("SysTick")?, address("USART1")?, address("CAN2_RX0")?];
        let mut board = EmulatedBoard::boot(elf)?;
        let mut station = Station::default();
        // Enough bytes for all samples of USART1's interrupt below.
        for count in 1..=50_u32 {
            let (state, _) = motion(count as f32);
            station.track(u64::from(count), state);
        }
        board.send(&station.take())?;
        let gdb = board.halt()?;
        gdb.run_to(encode, PATIENCE)?;
        let dshot = gdb.count_function()?;
        // Few samples, since single steps are slower than the processor's real time.
        let mut most = |interrupt: u32, samples: u32| -> Result<u32, Error> {
            let mut most = 0;
            for _ in 0..samples {
                gdb.run_to(interrupt, PATIENCE)?;
                most = most.max(gdb.count_exception()?);
            }
            Ok(most)
        };
        Ok(BackgroundInstructions { dshot, systick: most(systick, 4)?, byte: most(byte, 200)?, wake: most(wake, 4)? })
    }
}

//! The clock of a timer that sends to motor controllers.

use afbc_types::{OutOfRange, Range};

/// Accepted clock of the timer \[Hz\]: DSHOT's pulses are within 4 % of a bit, and its periods fit the timer.
pub const TIMER_CLOCK: Range = Range::new("timer_hz", 8e6, 500e6);

/// A clock in [`TIMER_CLOCK`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimerClock(u32);

impl TimerClock {
    /// Accepts a clock \[Hz\].
    ///
    /// # Errors
    /// If it is outside [`TIMER_CLOCK`].
    pub fn new(timer_hz: u32) -> Result<Self, OutOfRange> {
        TIMER_CLOCK.check(timer_hz)?;
        Ok(TimerClock(timer_hz))
    }

    /// Returns it \[Hz\].
    pub const fn hz(self) -> u32 {
        self.0
    }
}

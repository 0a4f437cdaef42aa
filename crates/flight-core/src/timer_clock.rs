//! Clock of a timer that outputs motor signals.

use afbc_types::{OutOfRange, Range};

/// Accepted clock of the timer \[Hz\]. DSHOT's pulses are then accurate to 4 % of a bit, and its periods fit the timer.
pub const TIMER_CLOCK: Range = Range::new("timer_hz", 8e6, 500e6);

/// A clock within [`TIMER_CLOCK`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimerClock(u32);

impl TimerClock {
    /// Makes a clock \[Hz\].
    ///
    /// # Errors
    /// If it is outside [`TIMER_CLOCK`].
    pub fn new(timer_hz: u32) -> Result<Self, OutOfRange> {
        TIMER_CLOCK.check(timer_hz)?;
        Ok(TimerClock(timer_hz))
    }

    /// Returns the clock \[Hz\].
    pub const fn hz(self) -> u32 {
        self.0
    }
}

//! PWM and OneShot125: the throttle is the length of a pulse.
//!
//! A timer outputs the pulse. It counts up from 0, and its pin is high below the compare value.

use crate::motor::{THROTTLE_MAX, THROTTLE_MIN};
use crate::timer_clock::TimerClock;

/// Pulse lengths and period of a protocol.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PulseFormat {
    /// Pulse length of a stopped motor \[us\].
    pub shortest_us: u16,
    /// Pulse length of full throttle \[us\].
    pub longest_us: u16,
    /// Period of the timer \[us\].
    pub period_us: u16,
    /// True if each tick starts one pulse, with none in between; false if the timer repeats the newest pulse by itself.
    pub is_one_shot: bool,
}

impl PulseFormat {
    /// PWM at 400 Hz.
    pub const PWM400: Self = PulseFormat { shortest_us: 1000, longest_us: 2000, period_us: 2500, is_one_shot: false };
    /// OneShot125: the pulses of PWM divided by eight. The timer's period is two ticks, so that it never ends between
    /// ticks.
    pub const ONESHOT125: Self = PulseFormat { shortest_us: 125, longest_us: 250, period_us: 2000, is_one_shot: true };
}

/// Number of throttle steps from the smallest to the largest.
const SPAN: u32 = (THROTTLE_MAX - THROTTLE_MIN) as u32;

/// Pulse lengths in timer counts: 16 bits, at the finest resolution that fits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PulseTiming {
    divider: u16,
    period: u16,
    shortest: u16,
    span: u16,
}

impl PulseTiming {
    /// Computes the pulse lengths for a timer with this clock.
    pub fn new(clock: TimerClock, format: PulseFormat) -> Self {
        // `clocks` returns millionths of a clock. A period is at most 1.25 million clocks.
        let clocks = |us: u16| u64::from(clock.hz()) * u64::from(us);
        let longest = 1_000_000 * u64::from(u16::MAX);
        let divider = clocks(format.period_us).div_ceil(longest).max(1);
        let counts = |us: u16| ((clocks(us) + divider * 500_000) / (divider * 1_000_000)) as u16;
        let shortest = counts(format.shortest_us);
        let span = counts(format.longest_us).saturating_sub(shortest);
        // The divider is at most 20: 1.25 million clocks in a period of up to 65,535 counts.
        PulseTiming { divider: divider as u16, period: counts(format.period_us), shortest, span }
    }

    /// Returns the clocks per count; the timer's prescaler value is one less.
    pub const fn divider(&self) -> u16 {
        self.divider
    }

    /// Returns the counts per period; the timer's reload value is one less.
    pub const fn period(&self) -> u16 {
        self.period
    }

    /// Returns the compare value for a throttle: the shortest pulse for 48, the longest for 2047, linear in between.
    /// Other values, such as 0, stop the motor, as in [`DshotFrame::new`](crate::dshot::DshotFrame::new).
    pub fn compare(&self, throttle: u16) -> u16 {
        let steps = match throttle {
            THROTTLE_MIN..=THROTTLE_MAX => u32::from(throttle - THROTTLE_MIN),
            _ => 0,
        };
        self.shortest + ((u32::from(self.span) * steps + SPAN / 2) / SPAN) as u16
    }
}

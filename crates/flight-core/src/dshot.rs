//! DSHOT600: sixteen bits to a motor controller, each a pulse whose length is its value.
//!
//! A bit lasts 1.67 us (600 kbit/s); its pulse is high for 1250 ns if it is one and for 625 ns if it is zero, that is
//! for 3/4 and 3/8 of the bit. The [`Waveform`] is output by a timer with one bit per period, whose compare values are
//! read from memory.

use afbc_types::{OutOfRange, Range};

/// Bits per second.
pub const BIT_RATE_HZ: u32 = 600_000;
/// Accepted clock of the timer \[Hz\]: pulse lengths are within 4 % of a bit, and a period fits the timer.
pub const TIMER_CLOCK: Range = Range::new("timer_hz", 8e6, 500e6);

/// A frame: 11 bits of throttle, the telemetry request (always off), 4 bits of checksum; sent from the highest bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DshotFrame(u16);

impl DshotFrame {
    /// Creates the frame for a throttle of 0 (stop) or 48 to 2047. Other values stop the motor: 1 to 47 are commands to
    /// the motor controller, which are not used.
    pub const fn new(throttle: u16) -> Self {
        let throttle = match throttle {
            crate::motor::THROTTLE_MIN..=crate::motor::THROTTLE_MAX => throttle,
            _ => 0,
        };
        let data = throttle << 1;
        let checksum = (data ^ (data >> 4) ^ (data >> 8)) & 0xF;
        DshotFrame(data << 4 | checksum)
    }

    /// Returns the sixteen bits.
    pub const fn bits(self) -> u16 {
        self.0
    }
}

/// Compare values of a frame: one pulse per bit, then a zero that leaves the line low.
pub type Waveform = [u16; 17];

/// Pulse lengths in timer counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Timing {
    period: u16,
    one: u16,
    zero: u16,
}

impl Timing {
    /// Computes the lengths for a timer that counts at `timer_hz`.
    ///
    /// # Errors
    /// If the clock is outside [`TIMER_CLOCK`].
    pub fn new(timer_hz: u32) -> Result<Self, OutOfRange> {
        TIMER_CLOCK.check(timer_hz)?;
        let counts = |numerator: u32, denominator: u32| {
            let rate_hz = BIT_RATE_HZ * denominator;
            ((timer_hz * numerator + rate_hz / 2) / rate_hz) as u16
        };
        Ok(Timing { period: counts(1, 1), one: counts(3, 4), zero: counts(3, 8) })
    }

    /// Returns the counts per bit; the timer reloads at one less.
    pub const fn period(&self) -> u16 {
        self.period
    }

    /// Computes the compare values of several motors: a row for each bit, a column for each motor, each column a
    /// [waveform](Self::waveform).
    pub fn rows<const N: usize, W: Copy + From<u16>>(&self, throttles: [u16; N], rows: &mut [[W; N]; 17]) {
        let mut frames = throttles.map(|throttle| DshotFrame::new(throttle).bits());
        let [bits @ .., last] = rows;
        for row in bits {
            *row = frames.map(|bits| W::from(self.pulse(bits & 0x8000 != 0)));
            frames = frames.map(|bits| bits << 1);
        }
        *last = [W::from(0); N];
    }

    /// Returns the length of a pulse.
    const fn pulse(&self, one: bool) -> u16 {
        if one { self.one } else { self.zero }
    }

    /// Returns the compare values of `frame`.
    pub fn waveform(&self, frame: DshotFrame) -> Waveform {
        let mut bits = frame.bits();
        let mut waveform = [0; 17];
        for pulse in waveform.iter_mut().take(16) {
            *pulse = self.pulse(bits & 0x8000 != 0);
            bits <<= 1;
        }
        waveform
    }
}

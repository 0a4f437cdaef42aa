//! DSHOT: sends sixteen bits to a motor controller (ESC), each as a pulse whose length is the bit's value.
//!
//! The pulse is high for 3/4 of the bit's time for a one, and for 3/8 for a zero. At 600 kbit/s a bit lasts 1.67 us,
//! and its pulse 1250 ns or 625 ns. A timer outputs the [`Waveform`] with one bit per period, reading its compare
//! values from memory.

use crate::timer_clock::TimerClock;

/// Bits per second.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "each variant is named after its rate in kbit/s")]
#[repr(u32)]
pub enum DshotRate {
    Dshot150 = 150_000,
    Dshot300 = 300_000,
    Dshot600 = 600_000,
}

/// A frame: 11 bits of throttle, the telemetry request, 4 bits of checksum. The highest bit is sent first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DshotFrame(u16);

impl DshotFrame {
    /// Makes the frame for a throttle of 0 (stop) or 48 to 2047. Other values stop the motor: 1 to 47 are ESC commands,
    /// which are not used.
    pub const fn new(throttle: u16) -> Self {
        let throttle = match throttle {
            crate::motor::THROTTLE_MIN..=crate::motor::THROTTLE_MAX => throttle,
            _ => 0,
        };
        Self::of(throttle << 1)
    }

    /// Returns the frame with the telemetry request: the motor controller replies once over the serial line.
    #[must_use]
    pub const fn asking(self) -> Self {
        Self::of(self.0 >> 4 | 1)
    }

    /// Returns the frame for bidirectional DSHOT, with the complemented checksum by which a motor controller recognises
    /// it. The whole frame is sent with the line inverted.
    #[must_use]
    pub const fn bidirectional(self) -> Self {
        DshotFrame(self.0 ^ 0xF)
    }

    /// Appends the checksum to twelve bits of data.
    const fn of(data: u16) -> Self {
        let checksum = (data ^ (data >> 4) ^ (data >> 8)) & 0xF;
        DshotFrame(data << 4 | checksum)
    }

    /// Returns the frame's sixteen bits.
    pub const fn bits(self) -> u16 {
        self.0
    }
}

/// Timer compare values of a frame: one pulse per bit, then a zero that leaves the line low.
pub type Waveform = [u16; 17];

/// Pulse lengths in timer counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Timing {
    period: u16,
    one: u16,
    zero: u16,
}

impl Timing {
    /// Computes the pulse lengths for a timer that counts at `clock`.
    pub const fn new(clock: TimerClock, rate: DshotRate) -> Self {
        const fn counts(clock: TimerClock, rate: DshotRate, numerator: u32, denominator: u32) -> u16 {
            // The sum cannot overflow: three times 500 MHz and half a divisor are below 2^32.
            let rate_hz = rate as u32 * denominator;
            ((clock.hz() * numerator + rate_hz / 2) / rate_hz) as u16
        }
        Timing { period: counts(clock, rate, 1, 1), one: counts(clock, rate, 3, 4), zero: counts(clock, rate, 3, 8) }
    }

    /// Returns the counts per bit; the timer's reload value is one less.
    pub const fn period(&self) -> u16 {
        self.period
    }

    /// Computes the compare values of several motors: a row per bit, a column per motor. Each column is a
    /// [waveform](Self::waveform). The motor controller with the index `asked` gets the telemetry request.
    pub fn rows<const N: usize, W: Copy + From<u16>>(
        &self,
        throttles: [u16; N],
        asked: Option<usize>,
        rows: &mut [[W; N]; 17],
    ) {
        let mut frames = throttles.map(DshotFrame::new);
        if let Some(frame) = asked.and_then(|asked| frames.get_mut(asked)) {
            *frame = frame.asking();
        }
        let mut frames = frames.map(DshotFrame::bits);
        let [bits @ .., last] = rows;
        for row in bits {
            *row = frames.map(|bits| W::from(self.pulse(bits & 0x8000 != 0)));
            frames = frames.map(|bits| bits << 1);
        }
        *last = [W::from(0); N];
    }

    /// Converts [rows](Self::rows) to bidirectional DSHOT by [complementing each checksum](DshotFrame::bidirectional).
    /// Send them with the line inverted.
    pub fn complement_checksums<const N: usize, W: Copy + From<u16> + Into<u32>>(&self, rows: &mut [[W; N]; 17]) {
        // The checksum is the last four of the sixteen bits.
        for pulse in rows.iter_mut().skip(12).take(4).flatten() {
            let is_one = (*pulse).into() == u32::from(self.one);
            *pulse = W::from(self.pulse(!is_one));
        }
    }

    /// Returns the length of a bit's pulse.
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

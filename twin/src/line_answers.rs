//! Motor controllers that answer on their signal lines (bidirectional DSHOT). Some time after a frame, each drives its
//! line up and down. The levels are written as pull-up or pull-down of the board's pin, which nothing else drives at
//! that time.

use afbc_flight_core::dshot_reply::DshotReply;
use rigless::mcu::{Mcu, Operate};
use rigless::soc::Width;
use rigless::time::VirtualNanos;

/// Magnetic poles of the motors, as in the vehicle's defaults.
const POLES: f64 = 14.0;
/// Time from the end of a frame to the answer, and period of the answer's bits \[ns\].
const PAUSE_NS: u64 = 30_000;
const BIT_NS: f64 = 1e9 / 750e3;
const BITS: u64 = 21;
/// Time for which the firmware samples the lines, with a small margin \[ns\].
const SAMPLED_NS: u64 = 80_000;

/// Motor pins of a timer: address of their port's pull register, and number of the first pin.
#[derive(Debug, PartialEq)]
pub struct MotorPort {
    pub pulls: u64,
    pub first: u8,
}

/// Answers of a timer's motor controllers.
#[derive(Clone, Debug)]
pub struct LineAnswers {
    lines: &'static MotorPort,
    /// Bits of each controller's next answer.
    bits: Vec<u32>,
    /// Times at which sampling and answers begin \[ns\], and number of bits sent so far.
    now: Option<([u64; 2], u64)>,
}

impl LineAnswers {
    /// Creates the controllers of this many motors, which stand still.
    pub fn new(lines: &'static MotorPort, motors: usize) -> Self {
        LineAnswers { lines, bits: vec![line(0.0); motors], now: None }
    }

    /// Sets the speeds of the rotors \[rad/s\].
    pub fn set_rotor_speeds(&mut self, speeds_rad_s: &[f64]) {
        for (bits, speed_rad_s) in self.bits.iter_mut().zip(speeds_rad_s) {
            *bits = line(*speed_rad_s);
        }
    }

    /// Starts the answers to a frame that ended at `ended_ns`. Sampling begins at `at`.
    pub fn begin(&mut self, at: VirtualNanos, ended_ns: u64) {
        self.now = Some(([at.0, ended_ns + PAUSE_NS], 0));
    }

    /// Returns the time of the next step \[ns\].
    pub fn next_ns(&self) -> Option<u64> {
        let ([sampled_ns, begins_ns], bits) = self.now?;
        // The time counts from the first bit, so that rounding errors do not add up. After the last bit, it is the end
        // of sampling.
        let bit_ns = begins_ns + (bits as f64 * BIT_NS) as u64;
        Some(if bits <= BITS { bit_ns } else { sampled_ns + SAMPLED_NS })
    }

    /// Sends the next bits, if they are due; returns true once sampling has ended.
    pub fn step(&mut self, mcu: &mut dyn Mcu, at: VirtualNanos) -> bool {
        if self.next_ns().is_none_or(|next_ns| at.0 < next_ns) {
            return false;
        }
        let Some((_, bit)) = &mut self.now else { return false };
        let place = *bit;
        *bit += 1;
        if place > BITS {
            self.now = None;
            return true;
        }
        let Ok(mut pulls) = mcu.read(at, self.lines.pulls, Width::W32) else { return false };
        for (pin, bits) in (self.lines.first..).zip(&self.bits) {
            // The lines idle high.
            let is_high = place == BITS || bits >> (BITS - 1 - place) & 1 == 1;
            pulls = pulls & !(0b11 << (2 * pin)) | (if is_high { 0b01 } else { 0b10 }) << (2 * pin);
        }
        let _ = mcu.write(at, self.lines.pulls, Width::W32, pulls);
        false
    }
}

/// Returns the line levels that encode a rotor's speed \[rad/s\].
fn line(speed_rad_s: f64) -> u32 {
    let speed_rev_min = (speed_rad_s * 30.0 / std::f64::consts::TAU * POLES) as u32;
    DshotReply::line_of_bits(DshotReply::bits_of_speed(speed_rev_min))
}

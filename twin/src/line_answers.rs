//! Motor controllers that answer on the lines of their motors (bidirectional DSHOT): some time after a frame each pulls
//! its line up and down. What drives a line is written as the pull of its pin, which nothing else drives then.

use afbc_flight_core::dshot_reply::DshotReply;
use rigless::mcu::{Mcu, Operate};
use rigless::soc::Width;
use rigless::time::VirtualNanos;

/// Magnetic poles of the motors, the vehicle's default.
const POLES: f64 = 14.0;
/// Time from the end of a frame to its answer, and of a bit of it \[ns\].
const PAUSE_NS: u64 = 30_000;
const BIT_NS: f64 = 1e9 / 750e3;
const BITS: u64 = 21;
/// How long the lines are sampled, and a little more \[ns\].
const SAMPLED_NS: u64 = 80_000;

/// The pins of a timer's motors: the address of the register of their pulls, and the first one's number.
#[derive(Debug, PartialEq)]
pub struct Lines {
    pub pulls: u64,
    pub first: u8,
}

/// What the controllers of a timer do.
#[derive(Clone, Debug)]
pub struct LineAnswers {
    lines: &'static Lines,
    /// Bits of each one's next answer.
    bits: Vec<u32>,
    /// When sampling and answers began \[ns\], and how many bits are on the lines.
    now: Option<([u64; 2], u64)>,
}

impl LineAnswers {
    /// Of so many, which do not turn.
    pub fn new(lines: &'static Lines, motors: usize) -> Self {
        LineAnswers { lines, bits: vec![line(0.0); motors], now: None }
    }

    /// Sets what the rotors do \[rad/s\].
    pub fn turn(&mut self, speeds_rad_s: &[f64]) {
        for (bits, speed_rad_s) in self.bits.iter_mut().zip(speeds_rad_s) {
            *bits = line(*speed_rad_s);
        }
    }

    /// Begins with the answers to a frame that has ended at this time \[ns\].
    pub fn begin(&mut self, at: VirtualNanos, ended_ns: u64) {
        self.now = Some(([at.0, ended_ns + PAUSE_NS], 0));
    }

    /// Returns when it goes on \[ns\].
    pub fn next_ns(&self) -> Option<u64> {
        let ([sampled_ns, begins_ns], bits) = self.now?;
        // From the first bit on, so that what is rounded does not add up; and the end of the samples.
        let bit_ns = begins_ns + (bits as f64 * BIT_NS) as u64;
        Some(if bits <= BITS { bit_ns } else { sampled_ns + SAMPLED_NS })
    }

    /// Goes on, if it is time to; true once nobody looks at the lines any more.
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
            // They rest high.
            let is_high = place == BITS || bits >> (BITS - 1 - place) & 1 == 1;
            pulls = pulls & !(0b11 << (2 * pin)) | (if is_high { 0b01 } else { 0b10 }) << (2 * pin);
        }
        let _ = mcu.write(at, self.lines.pulls, Width::W32, pulls);
        false
    }
}

/// Returns the levels of a line for a rotor's speed \[rad/s\].
fn line(speed_rad_s: f64) -> u32 {
    let speed_rev_min = (speed_rad_s * 30.0 / std::f64::consts::TAU * POLES) as u32;
    DshotReply::line_of_bits(DshotReply::bits_of_speed(speed_rev_min))
}

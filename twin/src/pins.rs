//! Motor commands, read from the pins: DSHOT600, bit by bit.

use rigless::machine::flight::Actuator;

/// Bits of a frame.
pub const BITS: u64 = 16;
/// Time of a bit \[ns\].
pub const BIT_NS: f64 = 1e9 / 600e3;
/// Lengths of the pulses of a zero and of a one \[ns\], and what a count of the timers may change \[ns\].
const PULSES_NS: [u64; 2] = [625, 1_250];
const COUNT_NS: u64 = 5;

/// The frames of some motors while they are sent.
#[derive(Clone, Debug)]
pub struct Frames {
    bits: Vec<u16>,
    pub sent: u64,
    /// What was no frame.
    pub wrong: Vec<String>,
}

impl Frames {
    /// Of so many motors.
    pub fn new(motors: usize) -> Self {
        Frames { bits: vec![0; motors], sent: 0, wrong: Vec::new() }
    }

    /// Takes the next bit of each, while its pulse is on the pin.
    pub fn take(&mut self, pins: &[Actuator]) {
        for (pin, bits) in pins.iter().zip(&mut self.bits) {
            let width = pin.pulse.map_or(0, |pulse| pulse.width.0);
            let bit = PULSES_NS.iter().position(|length| length.abs_diff(width) <= COUNT_NS);
            if bit.is_none() && self.wrong.len() < 10 {
                self.wrong.push(format!("{}: a pulse of {width} ns", pin.name));
            }
            *bits = *bits << 1 | bit.unwrap_or(0) as u16;
        }
    }

    /// Returns the throttles of whole frames; none for a frame with a wrong checksum.
    pub fn throttles(&mut self) -> Vec<Option<u16>> {
        self.sent += 1;
        let frames = self.bits.iter_mut().map(std::mem::take);
        let throttles: Vec<_> = frames
            .map(|frame| {
                let data = frame >> 4;
                let checksum = (data ^ (data >> 4) ^ (data >> 8)) & 0xF;
                (checksum == frame & 0xF).then_some(data >> 1)
            })
            .collect();
        if throttles.contains(&None) && self.wrong.len() < 10 {
            self.wrong.push(format!("frame {}: a wrong checksum", self.sent));
        }
        throttles
    }
}

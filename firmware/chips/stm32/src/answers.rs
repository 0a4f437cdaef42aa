//! Receives bidirectional DSHOT: motor controllers answer on the lines of their motors. After each frame, the timer
//! that sent the frame samples the port of its pins by the same DMA. So DMA must reach the port. It does on an STM32H7;
//! an STM32F4's DMA1 does not.

use afbc_flight_core::dshot::DshotRate;
use afbc_flight_core::dshot_reply::{DshotReply, RATE_RATIO};
use afbc_flight_core::timer_clock::TimerClock;
use embassy_stm32::pac::gpio::Gpio;
use embassy_stm32::pac::gpio::vals::{Moder, Pupdr};

/// Lines of a timer, one per channel.
const LINES: usize = 4;
/// Samples per bit of an answer.
const PER_BIT: u16 = 3;
/// Samples after a frame: 56 bits of an answer. A controller waits for at least 15 of these bits, usually some 23,
/// before it sends its 21 bits.
const SAMPLES: usize = 168;
/// Number of first samples that belong to no answer.
const QUIET: usize = 30;

/// Motor lines of a timer, all on one port.
pub struct Lines {
    port: Gpio,
    /// Pin number of each channel.
    pins: [u8; LINES],
    samples: [u16; SAMPLES],
    /// True if the odd channels' answers were read last.
    odd: bool,
}

impl Lines {
    /// Creates the lines on the pins of `port` with these numbers, for channels 1 to 4.
    pub fn new(port: Gpio, pins: [u8; LINES]) -> Self {
        Lines { port, pins, samples: [0; SAMPLES], odd: false }
    }

    /// Pulls the lines up: bidirectional DSHOT idles high.
    pub(crate) fn pull_up(&self) {
        self.port.pupdr().modify(|pull| self.each(|pin| pull.set_pupdr(pin, Pupdr::PULL_UP)));
    }

    /// Makes the lines inputs if `is_let_go`, else gives them back to the timer.
    pub(crate) fn let_go(&self, is_let_go: bool) {
        let mode = if is_let_go { Moder::INPUT } else { Moder::ALTERNATE };
        self.port.moder().modify(|modes| self.each(|pin| modes.set_moder(pin, mode)));
    }

    fn each(&self, set: impl FnMut(usize)) {
        self.pins.iter().map(|pin| usize::from(*pin)).for_each(set);
    }

    /// Returns the address of the port's input register and the buffer for its samples.
    pub(crate) fn sampling(&mut self) -> (*mut u16, &mut [u16]) {
        (self.port.idr().as_ptr().cast(), &mut self.samples)
    }

    /// Returns the electrical speeds \[rev/min\] that every second channel's controller has answered. Calls alternate
    /// between odd and even channels, since decoding all four would take too long.
    pub(crate) fn speeds_rev_min(&mut self) -> [(usize, Option<u32>); LINES / 2] {
        self.odd = !self.odd;
        let channels = if self.odd { [1, 3] } else { [0, 2] };
        let pins = channels.map(|channel: usize| self.pins.get(channel).copied().unwrap_or_default());
        let replies = DshotReply::from_port(self.samples.get(QUIET..).unwrap_or_default(), pins, PER_BIT);
        let [first, second] = replies.map(|reply| reply.ok().and_then(DshotReply::speed_rev_min));
        let [one, other] = channels;
        [(one, first), (other, second)]
    }
}

/// Returns the timer counts between two samples.
pub(crate) fn sample_counts(clock: TimerClock, rate: DshotRate) -> u16 {
    let [answer, frame] = RATE_RATIO;
    // The product does not overflow, because four times 500 MHz fits.
    let samples_hz = rate as u32 * answer * u32::from(PER_BIT);
    ((clock.hz() * frame + samples_hz / 2) / samples_hz) as u16
}

//! Motor controllers that answer on the lines of their motors (bidirectional DSHOT): after each frame the timer that
//! has sent it samples the port of its pins, by the same DMA. So DMA must reach the port, as it does on an STM32H7, and
//! an STM32F4's first controller does not.

use afbc_flight_core::dshot::DshotRate;
use afbc_flight_core::dshot_reply::{DshotReply, RATE_RATIO};
use afbc_flight_core::timer_clock::TimerClock;
use embassy_stm32::pac::gpio::Gpio;
use embassy_stm32::pac::gpio::vals::{Moder, Pupdr};

/// Lines of a timer, one for each of its channels.
const LINES: usize = 4;
/// Samples in a bit of an answer.
const PER_BIT: u16 = 3;
/// Samples after a frame: 56 bits of an answer. Controllers let pass 15 of them at least, some 23 usually, before they
/// send 21.
const SAMPLES: usize = 168;
/// The first ones, which are none of an answer.
const QUIET: usize = 30;

/// The lines of a timer's motors, which are on one port.
pub struct Lines {
    port: Gpio,
    /// Number of each channel's pin.
    pins: [u8; LINES],
    samples: [u16; SAMPLES],
    /// Whose answers were read last.
    odd: bool,
}

impl Lines {
    /// The pins of a port with these numbers, of channels 1 to 4.
    pub fn new(port: Gpio, pins: [u8; LINES]) -> Self {
        Lines { port, pins, samples: [0; SAMPLES], odd: false }
    }

    /// Pulls them up, where they rest.
    pub(crate) fn pull_up(&self) {
        self.port.pupdr().modify(|pull| self.each(|pin| pull.set_pupdr(pin, Pupdr::PULL_UP)));
    }

    /// Lets go of them, or takes them again for the timer.
    pub(crate) fn let_go(&self, is_let_go: bool) {
        let mode = if is_let_go { Moder::INPUT } else { Moder::ALTERNATE };
        self.port.moder().modify(|modes| self.each(|pin| modes.set_moder(pin, mode)));
    }

    fn each(&self, set: impl FnMut(usize)) {
        self.pins.iter().map(|pin| usize::from(*pin)).for_each(set);
    }

    /// Returns the address from which the port is read, and where samples of it go.
    pub(crate) fn sampling(&mut self) -> (*mut u16, &mut [u16]) {
        (self.port.idr().as_ptr().cast(), &mut self.samples)
    }

    /// Returns the electrical speeds \[rev/min\] that the controllers on every second channel have answered: after one
    /// frame on the even ones, after the next on the odd ones. Twice as many at once would take too long.
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

/// Returns the counts of a timer from one sample to the next.
pub(crate) fn sample_counts(clock: TimerClock, rate: DshotRate) -> u16 {
    let [answer, frame] = RATE_RATIO;
    // No overflow: four times 500 MHz.
    let samples_hz = rate as u32 * answer * u32::from(PER_BIT);
    ((clock.hz() * frame + samples_hz / 2) / samples_hz) as u16
}

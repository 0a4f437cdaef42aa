//! Compares the emulated processor with the host.

use crate::emulator::{Emulator, TickReply};
use afbc_hil::{Autopilot, Error, Extremes, Host, HostTick};
use afbc_onboard::Readings;

/// Runs the emulated processor and the same code on the host with the same bytes at the same times, and compares every
/// output of every tick. The loop has no other input. So as long as no output differs, the host alone would have flown
/// the same flight.
pub struct LockstepPair {
    emulator: Emulator,
    host: Host,
    comparison: LockstepComparison,
}

/// Result of comparing the emulated processor with the host.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LockstepComparison {
    /// Number of compared control ticks.
    pub ticks: u64,
    /// Number of armed ticks among them.
    pub armed_ticks: u64,
    /// Number of compared bits, in throttles and link bytes.
    pub bits: u64,
    /// Number of ticks with a differing bit.
    pub differing_ticks: u64,
    /// Number of differing bits; a byte that only one side sends counts as eight.
    pub differing_bits: u64,
    /// First tick with a differing bit, counted from 0.
    pub first_difference: Option<u64>,
    /// Instructions of each armed control tick.
    pub instructions: Extremes,
    /// Number of ticks that came late or early by the processor's own clock.
    pub late_ticks: u32,
    /// Largest stack depth so far, including interrupts \[bytes\].
    pub stack_bytes: u32,
}

impl LockstepPair {
    /// Creates the disarmed twins. `host` must have the firmware of the vehicle for which the image was built.
    pub fn new(emulator: Emulator, host: Host) -> Self {
        LockstepPair { emulator, host, comparison: LockstepComparison::default() }
    }

    /// Returns the result so far.
    pub fn comparison(&self) -> &LockstepComparison {
        &self.comparison
    }
}

impl Autopilot for LockstepPair {
    fn sense(&mut self, readings: &Readings) -> bool {
        self.emulator.sense(readings);
        self.host.sense(readings);
        true
    }

    fn exchange(&mut self, uplink: &[u8], hear: &mut dyn FnMut(&[u8])) -> Result<(), Error> {
        let reply = self.emulator.exchange(uplink).map_err(|error| Error::Autopilot(error.into()))?;
        // The host gets the processor's times, since these are measured, not computed.
        let tick = self.host.tick(uplink, reply.time_us, reply.tick_us());
        self.comparison.add(&reply, &tick);
        hear(&reply.bytes);
        Ok(())
    }
}

impl LockstepComparison {
    fn add(&mut self, reply: &TickReply, tick: &HostTick) {
        let differing_bits = differing_bits(reply, tick);
        if differing_bits > 0 {
            self.differing_ticks += 1;
            self.differing_bits += differing_bits;
            self.first_difference.get_or_insert(self.ticks);
        }
        self.ticks += 1;
        self.bits += 8 * (reply.bytes.len() as u64 + 2 * reply.throttles.len() as u64);
        if tick.report.mode.armed() {
            self.armed_ticks += 1;
            self.instructions.add(f64::from(reply.instructions));
        }
        self.late_ticks = tick.report.health.rate.off_ticks();
        self.stack_bytes = self.stack_bytes.max(reply.stack_bytes);
    }
}

fn differing_bits(reply: &TickReply, tick: &HostTick) -> u64 {
    let throttles = reply.throttles.iter().zip(tick.report.throttles).map(|(a, b)| (a ^ b).count_ones());
    let bytes = reply.bytes.iter().zip(&tick.bytes).map(|(a, b)| (a ^ b).count_ones());
    let unmatched = 8 * reply.bytes.len().abs_diff(tick.bytes.len()) as u64;
    u64::from(throttles.chain(bytes).sum::<u32>()) + unmatched
}

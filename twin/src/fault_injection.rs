//! Interface between a fault and the models, and outcomes of a flight.

use crate::hover_snapshot::LinkEnds;
use crate::impairments::Impairments;
use crate::machine::Machine;
use crate::random::Xorshift;
use rigless::chip::Placed;
use rigless::chip::uart::Rate;
use rigless::emulator::{Host, InterruptLine};
use rigless::session::Session;
use rigless::soc::Width;
use rigless::time::VirtualNanos;
use std::fmt;

/// Outcome of a flight, from worst to best.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum FaultOutcome {
    /// The vehicle fell or turned over.
    Lost,
    /// The vehicle came down upright and slowly, and disarmed.
    Lands,
    /// The vehicle kept flying as ordered.
    FliesOn,
}

impl fmt::Display for FaultOutcome {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            FaultOutcome::Lost => "lost",
            FaultOutcome::Lands => "lands",
            FaultOutcome::FliesOn => "flies on",
        })
    }
}

/// Actions that a fault may take on any board.
pub trait FaultTarget {
    /// Returns an inertial sensor's place on its bus, if the board has this sensor.
    fn imu(&mut self, number: usize) -> Option<&mut dyn Placed>;

    /// Makes this many bytes per million to the board arrive wrong.
    fn garble_link(&mut self, per_million: u32);

    /// Raises the interrupt of the first link's UART (0) or of the GNSS receiver's (1).
    fn raise(&mut self, uart: usize, host: &mut dyn Host);

    /// Stops the models at a time, unless a stop is already set.
    fn stop_at(&mut self, at: VirtualNanos);

    /// Resets the chip.
    fn reset(&mut self, at: VirtualNanos, instructions: u64, host: &mut dyn Host);

    /// Fills the memories with noise, as after power-up.
    fn lose_memory(&mut self, host: &mut dyn Host, random: &mut Xorshift);
}

impl<M: Machine> FaultTarget for Session<M> {
    fn imu(&mut self, number: usize) -> Option<&mut dyn Placed> {
        self.board_mut().place(*M::IMUS.get(number)?)
    }

    fn garble_link(&mut self, per_million: u32) {
        self.board_mut().link_errors().noise = Rate { name: "telemetry.noise_errors", per_million };
    }

    fn raise(&mut self, uart: usize, host: &mut dyn Host) {
        if let Some(line) = M::UART_INTERRUPTS.get(uart).copied().and_then(InterruptLine::new) {
            self.pulse(line, host);
        }
    }

    fn stop_at(&mut self, at: VirtualNanos) {
        // A stop that is already set may be for a sample of the motor pins, which must not be missed.
        if self.pause().is_none() {
            self.pause_at(Some(at));
        }
    }

    fn reset(&mut self, at: VirtualNanos, instructions: u64, host: &mut dyn Host) {
        self.reset_by_pin(at, instructions, host);
    }

    fn lose_memory(&mut self, host: &mut dyn Host, random: &mut Xorshift) {
        let memory = self.mcu().bus().memory().to_vec();
        for region in memory.iter().filter(|region| region.kind.is_writable()) {
            for offset in (0..region.size).step_by(8) {
                let _ = host.write(region.base + offset, Width::W64, random.next());
            }
        }
    }
}

/// Models and state that a fault works on.
pub struct FaultContext<'a> {
    pub target: &'a mut dyn FaultTarget,
    pub host: &'a mut dyn Host,
    pub link: &'a LinkEnds,
    pub impairments: &'a mut Impairments,
    pub random: &'a mut Xorshift,
    pub at: VirtualNanos,
    pub instructions: u64,
    /// Time since the fault began.
    pub since_ns: u64,
    /// Number of earlier calls of the fault, and a number that the fault may store.
    pub looks: u64,
    pub kept: &'a mut u64,
}

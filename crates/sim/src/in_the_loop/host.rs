//! The firmware's code in this process.

use super::{Autopilot, Error};
use afbc_flight_core::Inbox;
use afbc_flight_core::rate::PERIOD_US;
use afbc_onboard::{Comms, Flight, Report};
use afbc_types::OutOfRange;

/// The firmware without its hardware, ticked in lockstep.
pub struct Host {
    flight: Flight,
    comms: Comms,
    inbox: Inbox,
    time_us: u64,
}

/// Result of one control tick.
#[derive(Clone, Debug)]
pub struct Tick {
    /// Report of the control tick.
    pub report: Report,
    /// Bytes sent over the link.
    pub bytes: Vec<u8>,
}

impl Host {
    /// Creates it powered up and disarmed.
    ///
    /// # Errors
    /// The first parameter out of range; does not occur.
    pub fn new() -> Result<Self, OutOfRange> {
        Ok(Host { flight: Flight::new()?, comms: Comms::new(), inbox: Inbox::default(), time_us: 0 })
    }

    /// Runs one control tick at `time_us` since power-up, after `uplink` has reached the link. The tick reports a
    /// duration of `cycles` cycles of 168 MHz.
    pub fn tick(&mut self, uplink: &[u8], time_us: u64, cycles: u32) -> Tick {
        self.inbox.post(&self.comms.receive(uplink));
        let report = self.flight.tick(time_us, &self.inbox.take());
        let mut bytes = Vec::new();
        self.comms.report(&report, cycles, |frame| bytes.extend_from_slice(frame));
        self.time_us = time_us;
        Tick { report, bytes }
    }

    /// Runs the tick a millisecond after the previous one, with a duration of zero.
    pub fn next_tick(&mut self, uplink: &[u8]) -> Tick {
        self.tick(uplink, self.time_us + PERIOD_US, 0)
    }
}

impl Autopilot for Host {
    fn exchange(&mut self, uplink: &[u8], hear: &mut dyn FnMut(&[u8])) -> Result<(), Error> {
        hear(&self.next_tick(uplink).bytes);
        Ok(())
    }
}

//! The firmware's code in this process.

use super::{Autopilot, Error};
use afbc_flight_core::Inbox;
use afbc_flight_core::rate::PERIOD_US;
use afbc_onboard::{Comms, Flight, Report};
use afbc_types::OutOfRange;

/// What the firmware is without its hardware, ticked in lockstep.
pub struct Host {
    flight: Flight,
    comms: Comms,
    inbox: Inbox,
    time_us: u64,
}

/// What one control tick did.
#[derive(Clone, Debug)]
pub struct Tick {
    /// What it decided.
    pub report: Report,
    /// What went out over the link.
    pub bytes: Vec<u8>,
}

impl Host {
    /// Powered up, disarmed.
    ///
    /// # Errors
    /// The first parameter out of range; none in fact.
    pub fn new() -> Result<Self, OutOfRange> {
        Ok(Host { flight: Flight::new()?, comms: Comms::new(), inbox: Inbox::default(), time_us: 0 })
    }

    /// One control tick at `time_us` since power-up: `uplink` reached the link before it. It says that it took `cycles`
    /// cycles of 168 MHz.
    pub fn tick(&mut self, uplink: &[u8], time_us: u64, cycles: u32) -> Tick {
        self.inbox.post(&self.comms.receive(uplink));
        let report = self.flight.tick(time_us, &self.inbox.take());
        let mut bytes = Vec::new();
        self.comms.report(&report, cycles, |frame| bytes.extend_from_slice(frame));
        self.time_us = time_us;
        Tick { report, bytes }
    }

    /// The tick that follows a millisecond after the last one, and takes no time.
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

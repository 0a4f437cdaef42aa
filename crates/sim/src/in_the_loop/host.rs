//! The firmware's code in this process.

use super::{Autopilot, Error};
use afbc::Profile;
use afbc_flight_core::Inbox;
use afbc_flight_core::rate::PERIOD_US;
use afbc_onboard::{Comms, Configuration, Flight, Readings, Report};
use afbc_types::{Airframe, OutOfRange, ROTORS_MAX, with_rotors};
use afbc_vehicles::Vehicle;

/// The firmware without its hardware, ticked in lockstep.
pub struct Host {
    flight: Box<dyn Core>,
    comms: Comms,
    inbox: Inbox,
    readings: Readings,
    time_us: u64,
}

/// The half that decides, of a vehicle with any number of rotors.
trait Core {
    fn tick(&mut self, now_us: u64, inbox: &mut Inbox, readings: &Readings) -> Report<ROTORS_MAX>;
}

impl<const N: usize> Core for Flight<N> {
    fn tick(&mut self, now_us: u64, inbox: &mut Inbox, readings: &Readings) -> Report<ROTORS_MAX> {
        Flight::tick(self, now_us, inbox, readings).padded()
    }
}

/// Result of one control tick.
#[derive(Clone, Debug)]
pub struct Tick {
    /// Report of the control tick.
    pub report: Report<ROTORS_MAX>,
    /// Bytes sent over the link.
    pub bytes: Vec<u8>,
}

impl Host {
    /// Creates the firmware of the paper's vehicle, powered up and disarmed.
    ///
    /// # Errors
    /// The first parameter out of range; does not occur.
    pub fn new() -> Result<Self, OutOfRange> {
        Ok(Self::of(Box::new(Flight::new(&Configuration::default())?)))
    }

    /// The firmware of this vehicle, powered up, disarmed.
    ///
    /// # Errors
    /// The first parameter out of range; none in fact, for a vehicle is checked when its file is read.
    pub fn for_vehicle(vehicle: &Vehicle) -> Result<Self, OutOfRange> {
        let (settings, gains) = (vehicle.settings(Profile::Flight), vehicle.gains(Profile::Flight));
        let (curve, estimation) = (vehicle.curve, vehicle.estimation);
        with_rotors!(vehicle.rotors.len(), N => {
            let airframe = Airframe::<N>::new(&vehicle.parameters, &vehicle.rotors)?;
            Ok(Self::of(Box::new(Flight::new(&Configuration { airframe, settings, gains, curve, estimation })?)))
        })
    }

    fn of(flight: Box<dyn Core>) -> Self {
        Host { flight, comms: Comms::new(), inbox: Inbox::default(), readings: Readings::NONE, time_us: 0 }
    }

    /// Sets what the vehicle's own sensors read for the next tick alone.
    pub fn sense(&mut self, readings: &Readings) {
        self.readings = *readings;
    }

    /// Runs one control tick at `time_us` since power-up, after `uplink` has reached the link. The tick reports a
    /// duration of `cycles` cycles of 168 MHz.
    pub fn tick(&mut self, uplink: &[u8], time_us: u64, cycles: u32) -> Tick {
        self.inbox.post(&self.comms.receive(uplink));
        let report = self.flight.tick(time_us, &mut self.inbox.take(), &core::mem::take(&mut self.readings));
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
    fn sense(&mut self, readings: &Readings) -> bool {
        Host::sense(self, readings);
        true
    }

    fn exchange(&mut self, uplink: &[u8], hear: &mut dyn FnMut(&[u8])) -> Result<(), Error> {
        hear(&self.next_tick(uplink).bytes);
        Ok(())
    }
}

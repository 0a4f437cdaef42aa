//! Interface to an autopilot at the other end of the link.

use super::Error;
use afbc_onboard::Readings;
use afbc_plant::Plant;

/// An autopilot, which exchanges bytes over the link.
pub trait Autopilot {
    /// Sets the vehicle's own sensor readings for the next [`exchange`](Self::exchange). Returns false if the readings
    /// cannot reach the autopilot.
    fn sense(&mut self, _readings: &Readings) -> bool {
        false
    }

    /// Lets the motor controllers of `plant` answer before the next [`exchange`](Self::exchange), if they are
    /// connected.
    fn turn_rotors(&mut self, _plant: &Plant) {}

    /// Runs one millisecond of the loop. Sends `uplink`, and passes the received bytes to `hear`, in pieces of any
    /// size.
    ///
    /// In lockstep this is one control tick, and `hear` gets its output. In real time it waits until the millisecond is
    /// over, and `hear` gets the bytes received so far.
    ///
    /// # Errors
    /// If the autopilot has failed.
    fn exchange(&mut self, uplink: &[u8], hear: &mut dyn FnMut(&[u8])) -> Result<(), Error>;
}

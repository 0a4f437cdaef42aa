//! Interface to an autopilot at the other end of the link.

use super::Error;
use afbc_onboard::Readings;
use afbc_plant::Plant;

/// Receives the link's bytes and answers with bytes.
pub trait Autopilot {
    /// Sets what the vehicle's own sensors read for the next [`exchange`](Self::exchange). False if these readings
    /// cannot reach it.
    fn sense(&mut self, _readings: &Readings) -> bool {
        false
    }

    /// Lets the motor controllers of `plant` answer before the next [`exchange`](Self::exchange), if they reach it.
    fn turn_rotors(&mut self, _plant: &Plant) {}

    /// Runs one millisecond of the loop: sends `uplink`, and passes the bytes received to `hear`, in pieces of any
    /// size.
    ///
    /// In lockstep this is one control tick, and `hear` gets its output. In real time it waits until the millisecond is
    /// over, and `hear` gets what has arrived.
    ///
    /// # Errors
    /// If the autopilot has failed.
    fn exchange(&mut self, uplink: &[u8], hear: &mut dyn FnMut(&[u8])) -> Result<(), Error>;
}

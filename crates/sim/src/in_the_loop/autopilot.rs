//! What is flown against.

use super::Error;

/// Whatever reads the link's bytes and answers with bytes.
pub trait Autopilot {
    /// One millisecond of the loop: hands over `uplink`, gives `hear` what comes back, in pieces of any size.
    ///
    /// In lockstep this is one control tick: `hear` gets what the tick says about `uplink`. In real time it waits until
    /// the millisecond is over, and `hear` gets what arrived meanwhile.
    ///
    /// # Errors
    /// If the autopilot is gone.
    fn exchange(&mut self, uplink: &[u8], hear: &mut dyn FnMut(&[u8])) -> Result<(), Error>;
}

//! Setup of the link by shell and parameters.

use afbc_mavlink::Reboot;
use afbc_onboard::Link;

/// Setup of the link by shell and parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Setup {
    /// MAVLink system id, 1 to 255.
    pub system: u8,
    /// Rate of the link without rotor commands for a simulator \[bytes/s\]. While rotor commands are sent, only 5/9 of
    /// it is used.
    pub bytes_per_s: u32,
    /// Kinds of reboot that the shell can do when [asked to](crate::Comms::wants_reboot).
    pub reboots: &'static [Reboot],
    /// True if the shell has sensors and calibrates them ([`Calibrator`](crate::Calibrator)).
    pub calibrates: bool,
}

impl Setup {
    /// Creates the setup from the parameters: 9/10 of the line's rate at ten bits per byte, no reboot and no
    /// calibration.
    pub fn of(link: &Link) -> Self {
        // The parameter is at most 250.
        Setup { system: link.system as u8, bytes_per_s: link.baud / 100 * 9, reboots: &[], calibrates: false }
    }
}

impl Default for Setup {
    /// Creates the setup from the parameters' defaults.
    fn default() -> Self {
        Self::of(&Link::DEFAULT)
    }
}

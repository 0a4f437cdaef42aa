//! What shell and parameters decide about the link.

use afbc_link::Reboot;
use afbc_onboard::Link;

/// What shell and parameters decide about the link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Setup {
    /// MAVLink system id, 1 to 255.
    pub system: u8,
    /// What everything but rotor commands for a simulator may take of the link: while these are sent, 5/9 of it
    /// \[bytes/s\].
    pub bytes_per_s: u32,
    /// What the shell reboots into when it is [asked to](crate::Comms::wants_reboot).
    pub reboots: &'static [Reboot],
    /// True if the shell has sensors and calibrates them ([`Calibrator`](crate::Calibrator)).
    pub calibrates: bool,
}

impl Setup {
    /// What the parameters make of it: nine tenths of the line, whose bytes have ten bits; no reboot.
    pub fn of(link: &Link) -> Self {
        // In range: at most 250.
        Setup { system: link.system as u8, bytes_per_s: link.baud / 100 * 9, reboots: &[], calibrates: false }
    }
}

impl Default for Setup {
    /// That of the parameters' defaults.
    fn default() -> Self {
        Self::of(&Link::DEFAULT)
    }
}

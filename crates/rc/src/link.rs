//! Detection of a lost radio link.

use crate::channels::Channels;

/// Number of consecutive frames needed to acquire the link. SBUS has no checksum, so noise can look like a frame, but
/// not this often in a row.
pub const ACQUIRE_FRAMES: u8 = 10;
/// Longest pause between two frames before the link is lost \[us\].
pub const SILENT_US: u64 = 500_000;
/// Time for which a regained link must last before the sticks count \[us\], as in Betaflight.
pub const RECOVERY_US: u64 = 500_000;
/// Plausible pulse lengths of a transmitter \[us\].
const PLAUSIBLE_US: core::ops::RangeInclusive<u16> = 800..=2200;

/// State of the radio link, judged by the arrival times of frames.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RadioLink {
    /// Newest channels and their arrival time \[us\].
    newest: Option<(Channels, u64)>,
    /// Number of consecutive frames, up to [`ACQUIRE_FRAMES`].
    in_row: u8,
    /// Time at which the link was acquired \[us\].
    since_us: Option<u64>,
    /// True if an acquired link was lost before.
    was_lost: bool,
}

impl RadioLink {
    /// Takes the channels of a frame.
    pub fn take(&mut self, channels: &Channels, now_us: u64) {
        if !channels.us.iter().all(|us| *us == 0 || PLAUSIBLE_US.contains(us)) {
            return self.refuse();
        }
        if self.newest.is_none_or(|(_, at_us)| now_us.saturating_sub(at_us) > SILENT_US) {
            self.lose();
        }
        self.newest = Some((*channels, now_us));
        self.in_row = self.in_row.saturating_add(1).min(ACQUIRE_FRAMES);
        if self.in_row == ACQUIRE_FRAMES {
            self.since_us = self.since_us.or(Some(now_us));
        }
    }

    /// Takes note of an invalid frame, or one that the receiver marked as lost. The last channels stay valid until they
    /// time out. Before the link is acquired, the count of consecutive frames restarts.
    pub fn refuse(&mut self) {
        if self.since_us.is_none() {
            self.in_row = 0;
        }
    }

    /// Marks the link as lost, for example because the receiver reports its failsafe.
    pub fn lose(&mut self) {
        self.was_lost |= self.since_us.is_some();
        (self.newest, self.in_row, self.since_us) = (None, 0, None);
    }

    /// Returns the newest channels while the link is up.
    pub fn heard(&self, now_us: u64) -> Option<&Channels> {
        self.since_us?;
        self.newest
            .as_ref()
            .filter(|(_, at_us)| now_us.saturating_sub(*at_us) <= SILENT_US)
            .map(|(channels, _)| channels)
    }

    /// Returns the arrival time of the newest channels \[us\].
    pub fn at_us(&self) -> Option<u64> {
        self.newest.map(|(_, at_us)| at_us)
    }

    /// True if the link is up and, after an earlier loss, has been up for long enough.
    pub fn is_steady(&self, now_us: u64) -> bool {
        let since = self.since_us.is_some_and(|since_us| now_us.saturating_sub(since_us) >= RECOVERY_US);
        self.heard(now_us).is_some() && (since || !self.was_lost)
    }
}

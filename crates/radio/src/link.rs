//! Whether the pilot is heard.

use crate::channels::Channels;

/// Frames that must have come one after the other before the first of them counts: noise that looks like a frame, which
/// SBUS without a checksum cannot tell, does not come so often.
pub const ACQUIRE_FRAMES: u8 = 10;
/// Longest pause between two of them \[us\].
pub const SILENT_US: u64 = 500_000;
/// Time for which a pilot who was lost must have been heard again before the sticks count \[us\], as in Betaflight.
pub const RECOVERY_US: u64 = 500_000;
/// Pulses that a transmitter may send \[us\].
const PLAUSIBLE_US: core::ops::RangeInclusive<u16> = 800..=2200;

/// Frames of a receiver, judged by their times.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RadioLink {
    /// The newest channels, and when they came \[us\].
    newest: Option<(Channels, u64)>,
    /// Number of frames in a row, up to [`ACQUIRE_FRAMES`].
    in_row: u8,
    /// When the pilot was acquired \[us\].
    since_us: Option<u64>,
    /// True if one was lost before.
    was_lost: bool,
}

impl RadioLink {
    /// Takes a frame's channels.
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

    /// Takes what was no frame, or one that the receiver marked as lost: the last channels stay until they are too old.
    /// Before the pilot is acquired, it begins anew.
    pub fn refuse(&mut self) {
        if self.since_us.is_none() {
            self.in_row = 0;
        }
    }

    /// The receiver has given the transmitter up.
    pub fn lose(&mut self) {
        self.was_lost |= self.since_us.is_some();
        (self.newest, self.in_row, self.since_us) = (None, 0, None);
    }

    /// Returns the newest channels of a pilot who is heard.
    pub fn heard(&self, now_us: u64) -> Option<&Channels> {
        self.since_us?;
        self.newest
            .as_ref()
            .filter(|(_, at_us)| now_us.saturating_sub(*at_us) <= SILENT_US)
            .map(|(channels, _)| channels)
    }

    /// When the newest channels came \[us\].
    pub fn at_us(&self) -> Option<u64> {
        self.newest.map(|(_, at_us)| at_us)
    }

    /// True if the pilot has been heard for long enough after a loss.
    pub fn is_steady(&self, now_us: u64) -> bool {
        let since = self.since_us.is_some_and(|since_us| now_us.saturating_sub(since_us) >= RECOVERY_US);
        self.heard(now_us).is_some() && (since || !self.was_lost)
    }
}

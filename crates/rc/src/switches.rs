//! Switches of a transmitter.

use crate::channels::Channels;
use crate::settings::RadioSettings;

/// A switch position that changes only after two equal frames in a row, since SBUS has no checksum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Debounced<T> {
    value: Option<T>,
    next: Option<T>,
}

impl<T> Default for Debounced<T> {
    fn default() -> Self {
        Debounced { value: None, next: None }
    }
}

impl<T: Copy + PartialEq> Debounced<T> {
    /// Takes the position in a new frame. Returns the old and new position if it has changed. The old position is none
    /// if the link has just come up.
    pub(crate) fn put(&mut self, position: T) -> Option<(Option<T>, T)> {
        let is_sure = self.next == Some(position);
        self.next = Some(position);
        if !is_sure || self.value == Some(position) {
            return None;
        }
        Some((self.value.replace(position), position))
    }

    pub(crate) fn get(&self) -> Option<T> {
        self.value
    }
}

/// Returns whether a switch is on; none if its channel is missing.
pub(crate) fn is_on(settings: &RadioSettings, channels: &Channels, number: u32, share: f32) -> Option<bool> {
    let (calibration, us) = settings.channel(channels, number)?;
    let way = 0.5 * (calibration.centred(us) + 1.0);
    Some(if share < 0.0 { way < -share } else { way > share })
}

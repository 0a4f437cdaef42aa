//! Switches of a transmitter.

use crate::channels::Channels;
use crate::settings::RadioSettings;

/// A position that counts once two frames in a row have it: SBUS has no checksum.
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
    /// Takes the position of a new frame; returns the old and the new one if it has changed. The old one is none when
    /// the pilot has just been heard.
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

/// True if a switch is on; none if there is none.
pub(crate) fn is_on(settings: &RadioSettings, channels: &Channels, number: u32, share: f32) -> Option<bool> {
    let (calibration, us) = settings.channel(channels, number)?;
    let way = 0.5 * (calibration.centred(us) + 1.0);
    Some(if share < 0.0 { way < -share } else { way > share })
}

//! Channels of radio control: a station's in place of a receiver's, and those that the vehicle has.

use crate::address::Address;
use crate::message::{MessageFormat, PAYLOAD_MAX};
use crate::wire::Layout;
use mavlink::MessageData;
use mavlink::dialects::common::{RC_CHANNELS_DATA, RC_CHANNELS_OVERRIDE_DATA};

/// Number of channels of both messages.
pub const RADIO_CHANNELS: usize = 18;
/// Channels of RC_CHANNELS_OVERRIDE that have been there from the beginning.
const FIRST: usize = 8;
/// A channel of RC_CHANNELS_OVERRIDE that is left alone, and one of RC_CHANNELS that is not there.
const NOTHING: u16 = u16::MAX;
/// One of the later channels of RC_CHANNELS_OVERRIDE that is given back.
const RELEASED: u16 = u16::MAX - 1;

/// RC_CHANNELS_OVERRIDE (70): pulses in place of a receiver's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChannelsOverride {
    raw_us: [u16; RADIO_CHANNELS],
}

/// Channels 1 to 8, receiver, channels 9 to 18.
const OVERRIDE: Layout<RC_CHANNELS_OVERRIDE_DATA, ([u16; FIRST], Address, [u16; RADIO_CHANNELS - FIRST])> = Layout::NEW;

impl ChannelsOverride {
    /// The message that sets each channel to a pulse, or gives it back where that is 0 \[us\].
    pub fn new(us: [u16; RADIO_CHANNELS]) -> Self {
        let mut raw_us = us;
        let later = raw_us.iter_mut().skip(FIRST);
        later.filter(|us| **us == 0).for_each(|us| *us = RELEASED);
        ChannelsOverride { raw_us }
    }

    /// Returns the pulse that the message sets a channel to, 0 if it gives it back; none if it leaves it alone \[us\].
    pub fn channel(&self, place: usize) -> Option<u16> {
        match *self.raw_us.get(place)? {
            NOTHING => None,
            // Of the later channels, 0 is what a sender of eight has there.
            0 if place >= FIRST => None,
            RELEASED if place >= FIRST => Some(0),
            raw => Some(raw),
        }
    }

    pub(crate) fn format() -> MessageFormat {
        OVERRIDE.format()
    }

    pub(crate) fn read(payload: &[u8]) -> (Self, Address) {
        let (first, to, later) = OVERRIDE.read(payload);
        let mut raw_us = [0; RADIO_CHANNELS];
        raw_us.iter_mut().zip(first.into_iter().chain(later)).for_each(|(to, from)| *to = from);
        (ChannelsOverride { raw_us }, to)
    }

    pub(crate) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        let channel = |place: usize| self.raw_us.get(place).copied().unwrap_or(NOTHING);
        let (first, later) = (core::array::from_fn(channel), core::array::from_fn(|place| channel(FIRST + place)));
        OVERRIDE.write(&(first, Address::default(), later), payload)
    }
}

/// RC_CHANNELS (65): the channels that the vehicle has of a pilot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RadioChannels {
    /// Time since power-up \[ms\].
    pub time_ms: u32,
    /// Pulses; 0 where there is no channel \[us\].
    pub us: [u16; RADIO_CHANNELS],
    /// How well the pilot is received, 0 to 254; 255 if unknown.
    pub rssi: u8,
}

/// Time, channels, their number, strength.
const CHANNELS: Layout<RC_CHANNELS_DATA, (u32, [u16; RADIO_CHANNELS], u8, u8)> = Layout::NEW;

/// Format of RC_CHANNELS.
pub(crate) fn format(id: u32) -> Option<MessageFormat> {
    (id == RC_CHANNELS_DATA::ID).then(|| CHANNELS.format())
}

impl RadioChannels {
    pub(crate) fn read(payload: &[u8]) -> Self {
        let (time_ms, us, _, rssi) = CHANNELS.read(payload);
        RadioChannels { time_ms, us: us.map(|us| if us == NOTHING { 0 } else { us }), rssi }
    }

    pub(crate) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        let RadioChannels { time_ms, us, rssi } = *self;
        let count = us.iter().rposition(|us| *us != 0).map_or(0, |last| last + 1) as u8;
        CHANNELS.write(&(time_ms, us.map(|us| if us == 0 { NOTHING } else { us }), count, rssi), payload)
    }
}

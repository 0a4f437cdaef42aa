//! Radio control channels: those that a ground station sends in place of a receiver, and those that the vehicle
//! reports.

use crate::address::Address;
use crate::message::{MessageFormat, PAYLOAD_MAX};
use crate::wire::MessageLayout;
use mavlink::MessageData;
use mavlink::dialects::common::{RC_CHANNELS_DATA, RC_CHANNELS_OVERRIDE_DATA};

/// Number of channels of both messages.
pub const RADIO_CHANNELS: usize = 18;
/// Number of channels in the original RC_CHANNELS_OVERRIDE; the others are extension fields.
const FIRST: usize = 8;
/// Value for a channel that RC_CHANNELS_OVERRIDE leaves unchanged, and for a missing channel of RC_CHANNELS.
const NOTHING: u16 = u16::MAX;
/// Value that releases one of the later channels of RC_CHANNELS_OVERRIDE.
const RELEASED: u16 = u16::MAX - 1;

/// RC_CHANNELS_OVERRIDE (70): pulses that replace a receiver's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChannelsOverride {
    raw_us: [u16; RADIO_CHANNELS],
}

/// Fields: channels 1 to 8, receiver, channels 9 to 18.
const OVERRIDE: MessageLayout<RC_CHANNELS_OVERRIDE_DATA, ([u16; FIRST], Address, [u16; RADIO_CHANNELS - FIRST])> =
    MessageLayout::NEW;

impl ChannelsOverride {
    /// Creates the message that overrides each channel with a pulse \[us\]; 0 releases the channel.
    pub fn new(us: [u16; RADIO_CHANNELS]) -> Self {
        let mut raw_us = us;
        let later = raw_us.iter_mut().skip(FIRST);
        later.filter(|us| **us == 0).for_each(|us| *us = RELEASED);
        ChannelsOverride { raw_us }
    }

    /// Returns the pulse that overrides a channel \[us\], 0 if the message releases the channel, none if it leaves it
    /// unchanged. `place` counts from 0.
    pub fn channel(&self, place: usize) -> Option<u16> {
        match *self.raw_us.get(place)? {
            NOTHING => None,
            // A sender that knows only eight channels leaves the later ones 0.
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

/// RC_CHANNELS (65): the pilot's channels as the vehicle receives them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RadioChannels {
    /// Time since power-up \[ms\].
    pub time_ms: u32,
    /// Pulses; 0 where there is no channel \[us\].
    pub us: [u16; RADIO_CHANNELS],
    /// Signal strength, 0 to 254; 255 if unknown.
    pub rssi: u8,
}

/// Fields: time, channels, number of channels, signal strength.
const CHANNELS: MessageLayout<RC_CHANNELS_DATA, (u32, [u16; RADIO_CHANNELS], u8, u8)> = MessageLayout::NEW;

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

//! Radio control channels on the wire, compared with the specification.

use afbc_mavlink::{
    Address, ChannelsOverride, Decoder, Downlink, Encoder, ExternalTarget, FRAME_MAX, RADIO_CHANNELS, RadioChannels,
    Telemetry, Uplink,
};
use proptest::prelude::*;

const VEHICLE: Address = Address { system: 1, component: 1 };
const STATION: Address = Address { system: 255, component: 190 };

fn sent(message: &Uplink) -> Vec<Uplink> {
    let mut buffer = [0; FRAME_MAX];
    let (mut decoder, mut heard) = (Decoder::new(VEHICLE), Vec::new());
    decoder.feed(Encoder::new(STATION).send(message, &mut buffer), |_, message| heard.push(message));
    heard
}

/// Returns a channel's pulse by the specification; `place` counts from 0, `before` is the receiver's pulse.
fn expected(place: usize, raw: u16, before: u16) -> u16 {
    match (place < 8, raw) {
        (_, 65_535) => before,
        (true, raw) => raw,
        (false, 0) => before,
        (false, 65_534) => 0,
        (false, raw) => raw,
    }
}

proptest! {
    #[test]
    fn an_override_arrives(us in prop::array::uniform18(prop_oneof![Just(0u16), 800u16..2200])) {
        let message = Uplink::Target(ExternalTarget::Channels(ChannelsOverride::new(us)));
        let heard = sent(&message);
        prop_assert_eq!(&heard, &[message]);
        let [Uplink::Target(ExternalTarget::Channels(channels))] = heard[..] else { panic!("{heard:?}") };
        // For the last ten channels, 0 was written as "released".
        prop_assert_eq!(core::array::from_fn(|place| channels.channel(place).unwrap_or(1234)), us);
    }

    /// Payloads written from the specification, with channels that are left unchanged or released.
    #[test]
    fn others_overrides_are_read(
        raw in prop::array::uniform18(prop_oneof![
            Just(0u16), Just(u16::MAX), Just(u16::MAX - 1), 800u16..2200,
        ]),
        before in prop::array::uniform18(0u16..2200),
    ) {
        // Wire order: channels 1 to 8, receiver, channels 9 to 18.
        let mut payload = Vec::new();
        raw[..8].iter().for_each(|us| payload.extend(us.to_le_bytes()));
        payload.extend([1, 1]);
        raw[8..].iter().for_each(|us| payload.extend(us.to_le_bytes()));
        let read = <Uplink as afbc_mavlink::MessageSet>::read(70, &payload, VEHICLE);
        let Ok(Uplink::Target(ExternalTarget::Channels(channels))) = read else { panic!("{read:?}") };
        for place in 0..RADIO_CHANNELS {
            let us = channels.channel(place).unwrap_or(before[place]);
            prop_assert_eq!(us, expected(place, raw[place], before[place]), "channel {}", place + 1);
        }
        let elsewhere = <Uplink as afbc_mavlink::MessageSet>::read(70, &{
            payload[16] = 9;
            payload
        }, VEHICLE);
        prop_assert!(elsewhere.is_err());
        prop_assert_eq!(channels.channel(RADIO_CHANNELS), None);
    }

    #[test]
    fn channels_are_shown(
        us in prop::array::uniform18(prop_oneof![Just(0u16), 800u16..2200]), time_ms: u32, rssi: u8,
    ) {
        let message = Downlink::Telemetry(Telemetry::Channels(RadioChannels { time_ms, us, rssi }));
        let mut buffer = [0; FRAME_MAX];
        let (mut decoder, mut heard) = (Decoder::new(STATION), Vec::new());
        let frame = Encoder::new(VEHICLE).send(&message, &mut buffer).to_vec();
        decoder.feed(&frame, |_, message: Downlink| heard.push(message));
        prop_assert_eq!(&heard, &[message]);
        // The number of channels follows the time and eighteen channels; trailing zeros are not sent.
        let payload = &frame[10..frame.len() - 2];
        let count = us.iter().rposition(|us| *us != 0).map_or(0, |last| last + 1);
        prop_assert_eq!(payload.get(40).copied().unwrap_or(0), count as u8);
    }
}

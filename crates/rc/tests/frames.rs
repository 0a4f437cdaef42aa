//! Receivers' frames, compared with other implementations, and invalid bytes.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic)]

use afbc_rc::{
    CRSF_GAP_US, Channels, CrsfDecoder, CrsfFrame, CrsfTelemetry, LinkStatistics, RadioLink, SbusDecoder, SbusFrame,
};
use proptest::prelude::*;

/// Pulses that CRSF's eleven bits can represent.
fn channels() -> impl Strategy<Value = Channels> {
    prop::array::uniform16(880u16..=2154).prop_map(Channels::of)
}

fn crsf(bytes: &[u8]) -> Vec<CrsfFrame> {
    let (mut decoder, mut frames) = (CrsfDecoder::default(), Vec::new());
    decoder.feed(bytes, 0, |frame| frames.push(frame));
    frames
}

/// Decodes pieces of bytes, each with the pause before it; returns the frames.
fn sbus(pieces: &[(u64, &[u8])]) -> Vec<SbusFrame> {
    let (mut decoder, mut frames, mut now_us) = (SbusDecoder::default(), Vec::new(), 0);
    for (pause_us, piece) in pieces {
        now_us += pause_us;
        decoder.feed(piece, now_us, |frame| frames.push(frame));
    }
    frames
}

proptest! {
    /// Compares with `crsf`, another implementation, as the encoder.
    #[test]
    fn crsf_channels_are_those_of_another_encoder(ticks in prop::array::uniform16(0u16..=2047)) {
        let packet = crsf::Packet::RcChannels(crsf::RcChannels(ticks));
        let raw = packet.into_raw(crsf::PacketAddress::Controller);
        let us = ticks.map(|ticks| ((i32::from(ticks) - 992) * 5 / 8 + 1500) as u16);
        prop_assert_eq!(crsf(raw.data()), [CrsfFrame::Channels(Channels::of(us))]);
    }

    #[test]
    fn crsf_channels_are_read_as_they_were_written(channels in channels()) {
        let frame = CrsfFrame::Channels(channels);
        prop_assert_eq!(crsf(&frame.encode()), [frame]);
        // The other implementation decodes them, too.
        let mut parser = crsf::PacketParser::<64>::new();
        parser.push_bytes(&frame.encode());
        let Some(Ok((_, crsf::Packet::RcChannels(read)))) = parser.next_packet() else { panic!("no packet") };
        for (ticks, us) in read.0.iter().zip(channels.us) {
            prop_assert_eq!((i32::from(*ticks) - 992) * 5 / 8 + 1500, i32::from(us));
        }
    }

    /// An 8-bit checksum detects any single wrong bit, and any group of wrong bits within eight consecutive bits
    /// (highest bit of each byte first).
    #[test]
    fn a_spoilt_crsf_frame_is_none(channels in channels(), at in 16usize..200, burst in 1u8..) {
        let mut bytes = CrsfFrame::Channels(channels).encode();
        let [high, low] = (u16::from(burst) << (8 - at % 8)).to_be_bytes();
        bytes[at / 8] ^= high;
        bytes[at / 8 + 1] ^= low;
        prop_assert_eq!(crsf(&bytes), []);
    }

    /// Every frame is found, however the bytes are split, after noise without a start byte.
    #[test]
    fn crsf_frames_are_found_in_noise(
        frames in prop::collection::vec((channels(), prop::collection::vec(0u8..0xC8, 0..80)), 1..6),
        piece in 1usize..70,
    ) {
        let (mut bytes, mut expected) = (Vec::new(), Vec::new());
        for (channels, noise) in &frames {
            bytes.extend_from_slice(noise);
            bytes.extend_from_slice(&CrsfFrame::Channels(*channels).encode());
            expected.push(CrsfFrame::Channels(*channels));
        }
        let (mut decoder, mut found) = (CrsfDecoder::default(), Vec::new());
        bytes.chunks(piece).for_each(|piece| decoder.feed(piece, 0, |frame| found.push(frame)));
        prop_assert_eq!(found, expected);
        prop_assert_eq!(decoder.good_frames() as usize, frames.len());
    }

    /// A frame that was cut short does not harm the next frame after the pause.
    #[test]
    fn a_cut_crsf_frame_costs_no_other(first in channels(), second in channels(), kept in 1usize..26) {
        let [first, second] = [first, second].map(CrsfFrame::Channels);
        let (mut decoder, mut found) = (CrsfDecoder::default(), Vec::new());
        decoder.feed(&first.encode()[..kept], 0, |frame| found.push(frame));
        decoder.feed(&second.encode(), CRSF_GAP_US, |frame| found.push(frame));
        prop_assert_eq!(found, [second]);
        prop_assert_eq!(decoder.bad_frames(), 1);
    }

    /// Random bytes do no harm, and only few are taken for frames.
    #[test]
    fn any_bytes_are_read(bytes in prop::collection::vec(any::<u8>(), 0..2000), piece in 1usize..90) {
        let (mut crsf, mut sbus) = (CrsfDecoder::default(), SbusDecoder::default());
        for (number, piece) in bytes.chunks(piece).enumerate() {
            crsf.feed(piece, number as u64 * 3_000, |_| ());
            sbus.feed(piece, number as u64 * 3_000, |_| ());
        }
        prop_assert!(crsf.good_frames() as usize <= bytes.len() / 4);
    }

    /// Compares with `sbus-rs`, another implementation, as the decoder.
    #[test]
    fn sbus_frames_are_those_of_another_decoder(
        us in prop::array::uniform16(875u16..=2154), frame_lost: bool, failsafe: bool,
    ) {
        let frame = SbusFrame { channels: Channels::of(us), frame_lost, failsafe };
        let bytes = frame.encode();
        prop_assert_eq!(sbus(&[(7_000, &bytes)]), [frame]);
        let read = sbus_rs::SbusPacket::from_array(&bytes).unwrap();
        prop_assert_eq!((read.flags.frame_lost, read.flags.failsafe), (frame_lost, failsafe));
        for (ticks, us) in read.channels.iter().zip(us) {
            prop_assert_eq!(u32::from(*ticks) * 5 / 8 + 875, u32::from(us));
        }
    }

    /// A frame begins only after a pause; the same bytes elsewhere are ignored.
    #[test]
    fn sbus_frames_begin_after_a_pause(us in prop::array::uniform16(1000u16..=2000), early in 1usize..24) {
        let frame = SbusFrame { channels: Channels::of(us), frame_lost: false, failsafe: false };
        let bytes = frame.encode();
        let (head, tail) = bytes.split_at(early);
        // A channel byte equal to the header could begin a frame.
        prop_assume!(tail[0] != 0x0F);
        prop_assert_eq!(sbus(&[(7_000, head), (500, tail)]), [frame]);
        prop_assert_eq!(sbus(&[(7_000, head), (7_000, tail), (500, &bytes)]), []);
        prop_assert_eq!(sbus(&[(7_000, &bytes), (0, &bytes), (7_000, &bytes)]), [frame, frame]);
    }
}

/// Feeds frames 15 ms apart, each followed after 2.5 ms by the bytes `between`. Returns the decoder and whether the
/// link is up.
fn listen(frames: impl Iterator<Item = [u8; 25]>, between: &[u8]) -> (SbusDecoder, bool) {
    let (mut decoder, mut link, mut now_us) = (SbusDecoder::default(), RadioLink::default(), 0);
    for frame in frames {
        now_us += 15_000;
        for (pause_us, bytes) in [(0, &frame[..]), (2_500, between)] {
            let bad = decoder.bad_frames();
            decoder.feed(bytes, now_us + pause_us, |frame| link.take(&frame.channels, now_us));
            // Counts bad frames like the vehicle does.
            if decoder.bad_frames() != bad {
                link.refuse();
            }
        }
    }
    (decoder, link.heard(now_us).is_some())
}

/// The frame of a Futaba R7003SB.
const R7003SB: [u8; 25] = [
    0x0F, 0x01, 0x1C, 0x20, 0xA8, 0x05, 0x08, 0x6A, 0x40, 0x03, 0x10, 0x80, 0x90, 0x85, 0x2C, 0x00, 0x01, 0x08, 0x40,
    0x00, 0x02, 0x10, 0x80, 0x00, 0x08,
];

#[test]
fn the_footers_of_known_receivers_count_at_once() {
    for footer in [0x00, 0x03, 0x04, 0x08, 0x13, 0x14, 0x18, 0x23, 0x24, 0x28, 0x33, 0x34, 0x38] {
        let mut bytes = R7003SB;
        bytes[24] = footer;
        assert_eq!(sbus(&[(7_000, &bytes)]).len(), 1, "{footer:#04x}");
    }
    // The first channel's eleven bits are 0x401.
    assert_eq!(sbus(&[(7_000, &R7003SB)])[0].channels.us[0], (0x401 * 5 / 8 + 875) as u16);
}

#[test]
fn a_footer_that_a_receiver_repeats_counts() {
    for footer in 0..=0xFF_u8 {
        let with = |footer: u8| {
            let mut bytes = R7003SB;
            bytes[24] = footer;
            bytes
        };
        // Each frame has the same footer, or a footer with a slot number that counts in two or four bits.
        for slots in [1, 4, 16] {
            let frames = |count: u8| (0..count).map(move |number| with(footer.wrapping_add((number % slots) << 4)));
            let (decoder, heard) = listen(frames(11), &[]);
            assert!(heard && decoder.good_frames() >= 10, "{footer:#04x}: {decoder:?}");
            // Sensors answer in SBUS2's slots between the frames.
            assert!(listen(frames(11), &[0x03, 0x84, 0x2F]).1, "{footer:#04x} with sensors");
        }
    }
    // A footer that changes in every frame is not a receiver's.
    let odd = |count: u8| (0..count).map(|number| (number % 2 * 5 + 1) | (number << 4));
    let frames = odd(200).map(|footer| {
        let mut bytes = R7003SB;
        bytes[24] = footer;
        bytes
    });
    let (decoder, heard) = listen(frames, &[]);
    assert!(!heard && decoder.good_frames() == 0, "{decoder:?}");
}

#[test]
fn a_footer_or_flag_that_is_none_spoils_a_frame() {
    let good = SbusFrame { channels: Channels::of([1500; 16]), frame_lost: false, failsafe: false }.encode();
    for (at, value, is_frame) in
        [(24, 0x00, true), (24, 0x34, true), (24, 0x01, false), (23, 0x03, true), (23, 0x10, false), (0, 0x0E, false)]
    {
        let mut bytes = good;
        bytes[at] = value;
        assert_eq!(sbus(&[(7_000, &bytes)]).len(), usize::from(is_frame), "byte {at} = {value}");
    }
}

/// The values are computed by hand from the specification's table.
#[test]
fn link_statistics_are_read() {
    let payload = [80, 70, 99, (-5i8) as u8, 1, 2, 3, 90, 98, 4];
    let packet = crsf::Packet::LinkStatistics(crsf::LinkStatistics {
        uplink_rssi_1: payload[0],
        uplink_rssi_2: payload[1],
        uplink_link_quality: payload[2],
        uplink_snr: -5,
        active_antenna: payload[4],
        rf_mode: payload[5],
        uplink_tx_power: payload[6],
        downlink_rssi: payload[7],
        downlink_link_quality: payload[8],
        downlink_snr: 4,
    });
    let raw = packet.into_raw(crsf::PacketAddress::Controller);
    let expected = LinkStatistics { rssi_dbm: -70, quality_percent: 99, snr_db: -5 };
    assert_eq!(crsf(raw.data()), [CrsfFrame::LinkStatistics(expected)]);
}

/// The payloads are as specified: big-endian, in the protocol's units, pitch before roll.
#[test]
fn telemetry_is_laid_out_as_specified() {
    let payload = |telemetry: CrsfTelemetry<'_>| {
        let bytes = telemetry.encode();
        assert_eq!((bytes[0], usize::from(bytes[1])), (0xC8, bytes.len() - 2));
        bytes[2..bytes.len() - 1].to_vec()
    };
    let battery = CrsfTelemetry::Battery { voltage_v: 16.24, current_a: 25.6, drawn_mah: 66_051.0, left: 0.755 };
    assert_eq!(payload(battery), [0x08, 0, 162, 1, 0, 1, 2, 3, 76]);
    let attitude = CrsfTelemetry::Attitude { angles_rad: [0.0256, -0.0001, 3.1] };
    assert_eq!(payload(attitude), [0x1E, 0xFF, 0xFF, 0x01, 0x00, 0x79, 0x18]);
    assert_eq!(payload(CrsfTelemetry::Mode("position")), b"\x21position\0");
    assert_eq!(payload(CrsfTelemetry::Mode("a name that no transmitter shows")), b"\x21anamethatnotra\0");
    let gps = CrsfTelemetry::Gps {
        place_1e7deg: [471_000_000, -85_000_000],
        speed_m_s: 10.0,
        course_rad: -core::f32::consts::FRAC_PI_2,
        height_m: 456.7,
        satellites: 17,
    };
    let expected = [0x02, 0x1C, 0x12, 0xE3, 0xC0, 0xFA, 0xEF, 0x00, 0xC0, 0x01, 0x68, 0x69, 0x78, 0x05, 0xB0, 17];
    assert_eq!(payload(gps), expected);
    // NaN becomes 0; numbers that are too large or negative become the nearest possible value.
    let odd = CrsfTelemetry::Battery { voltage_v: f32::NAN, current_a: -1.0, drawn_mah: f32::INFINITY, left: 7.0 };
    assert_eq!(payload(odd), [0x08, 0, 0, 0, 0, 0xFF, 0xFF, 0xFF, 100]);
}

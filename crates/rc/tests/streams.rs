//! Receivers as byte streams: every complete frame is decoded and counted, whatever lies between frames.
#![allow(clippy::indexing_slicing, missing_docs, reason = "tests")]

use afbc_rc::{CRSF_GAP_US, Channels, CrsfDecoder, CrsfFrame, SbusDecoder};
use proptest::prelude::*;

const RC_CHANNELS_PACKED: u8 = 0x16;

/// Computes the CRC-8 of polynomial 0xD5 bit by bit.
fn crc8(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |crc, byte| {
        (0..8).fold(crc ^ byte, |crc: u8, _| if crc & 0x80 == 0 { crc << 1 } else { crc << 1 ^ 0xD5 })
    })
}

fn frame(kind: u8, payload: &[u8]) -> Vec<u8> {
    let content = [&[kind], payload].concat();
    [&[0xC8, content.len() as u8 + 1], &content[..], &[crc8(&content)]].concat()
}

/// Packs sixteen channels of eleven bits, lowest bit first.
fn packed(ticks: &[u16; 16]) -> Vec<u8> {
    let bits: Vec<bool> = ticks.iter().flat_map(|ticks| (0..11).map(move |bit| ticks >> bit & 1 == 1)).collect();
    bits.chunks(8).map(|bits| bits.iter().rev().fold(0, |byte, bit| byte << 1 | u8::from(*bit))).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

    /// Tests frames of every length and type, one byte or many at a time, with bytes between them that begin no frame.
    #[test]
    fn every_whole_frame_is_counted(
        frames in prop::collection::vec((any::<u8>(), prop::collection::vec(any::<u8>(), 0..=60), 0..4_usize), 1..12),
        at_once in 1..200_usize,
    ) {
        let mut bytes = Vec::new();
        for (kind, payload, between) in &frames {
            bytes.extend(vec![0x11; *between]);
            bytes.extend(frame(*kind, payload));
        }
        let mut decoder = CrsfDecoder::default();
        bytes.chunks(at_once).for_each(|bytes| decoder.feed(bytes, 1_000, |_| ()));
        prop_assert_eq!((decoder.good_frames(), decoder.bad_frames()), (frames.len() as u32, 0));
    }

    /// The channels match the frame: 992 ticks are 1500 us, and a tick is five eighths of a microsecond.
    #[test]
    fn channels_are_read(ticks in prop::array::uniform16(0..2_048_u16), is_later in any::<bool>(), cut in 1..25_usize) {
        let bytes = frame(RC_CHANNELS_PACKED, &packed(&ticks));
        // Pulse lengths are rounded towards the centre.
        let us = ticks.map(|ticks| (1500.0 + (0.625 * (f64::from(ticks) - 992.0)).trunc()) as u16);
        let (mut decoder, mut read) = (CrsfDecoder::default(), Vec::new());
        // The rest of a frame is not joined to its beginning after a long pause.
        let (head, rest) = bytes.split_at(cut);
        let later_us = if is_later { CRSF_GAP_US } else { CRSF_GAP_US - 1 };
        decoder.feed(head, 10_000, |frame| read.push(frame));
        decoder.feed(rest, 10_000 + later_us, |frame| read.push(frame));
        decoder.feed(&bytes, 100_000, |frame| read.push(frame));
        let channels = Channels::of(us);
        prop_assert_eq!(&read[read.len() - 1], &CrsfFrame::Channels(channels));
        prop_assert!(is_later || read.len() == 2, "{read:?}");
        prop_assert!(!is_later || read.len() == 1 && decoder.bad_frames() > 0, "{read:?}");
    }
}

/// SBUS has no checksum. Frames that are cut short or have a wrong footer count as bad, all others as good.
#[test]
fn sbus_frames_are_counted() {
    let whole = [&[0x0F][..], &[0x55; 22], &[0x00, 0x00]].concat();
    let mut decoder = SbusDecoder::default();
    let (mut now_us, mut wanted) = (0, [0, 0]);
    for number in 0..60 {
        now_us += 20_000;
        let (bytes, is_whole) = match number % 4 {
            0 => (whole[..20].to_vec(), false),
            1 => ([&whole[..24], &[0xFF]].concat(), false),
            _ => (whole.clone(), true),
        };
        decoder.feed(&bytes, now_us, |_| ());
        wanted[usize::from(!is_whole)] += 1;
    }
    // A frame that was cut short is counted when the next frame arrives.
    assert_eq!([decoder.good_frames(), decoder.bad_frames()], wanted);
}

/// An invalid length is counted as bad at once and does not harm the next frame.
#[test]
fn lengths_of_no_frame_are_passed_over() {
    for length in (0..=u8::MAX).filter(|length| !(2..=62).contains(length)) {
        let mut decoder = CrsfDecoder::default();
        decoder.feed(&[&[0xC8, length][..], &frame(0x14, &[0; 10])].concat(), 1_000, |_| ());
        assert!(decoder.good_frames() == 1 && decoder.bad_frames() > 0, "{length}");
    }
}

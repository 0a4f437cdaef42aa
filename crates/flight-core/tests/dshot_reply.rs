//! Tests bidirectional DSHOT replies with an independent encoder: bits, codes, edges and samples.

use afbc_flight_core::dshot_reply::{DshotReply, EDGES_MAX, REPLY_BITS, ReplyError};
use proptest::collection::vec;
use proptest::prelude::*;

/// Appends the checksum to twelve bits: the complement of the exclusive or of three nibbles.
fn checked(content: u16) -> u16 {
    content << 4 | (15 - ((content % 16) ^ (content / 16 % 16) ^ (content / 256)))
}

/// Returns the levels of the 21 bits on the wire, from the code's table as published, for nibbles 0 to F.
fn levels(bits: u16) -> Vec<bool> {
    let table = [
        "11001", "11011", "10010", "10011", "11101", "10101", "10110", "10111", "11010", "01001", "01010", "01011",
        "11110", "01101", "01110", "01111",
    ];
    let code =
        format!("{bits:04X}").chars().map(|digit| table[digit.to_digit(16).unwrap() as usize]).collect::<String>();
    let mut level = false;
    let mut levels = vec![level];
    for change in code.chars() {
        level ^= change == '1';
        levels.push(level);
    }
    levels
}

/// Returns the times of the level changes from the start bit on, with `counts` per bit.
fn edges(levels: &[bool], counts: f64) -> Vec<f64> {
    let before = std::iter::once(true).chain(levels.iter().copied());
    let line: Vec<bool> = before.chain([true]).collect();
    (0..line.len() - 1).filter(|at| line[*at] != line[at + 1]).map(|at| at as f64 * counts).collect()
}

fn samples(levels: &[bool], per_bit: usize, before: usize, after: usize) -> Vec<bool> {
    let bits = levels.iter().flat_map(|level| std::iter::repeat_n(*level, per_bit));
    std::iter::repeat_n(true, before).chain(bits).chain(std::iter::repeat_n(true, after)).collect()
}

/// Returns a period's content as motor controllers write it, nine bits shifted as far as needed, and the period that
/// remains after rounding.
fn period_content(period_us: u32) -> (u16, u32) {
    let exponent = (0..8).find(|exponent| period_us >> exponent < 512).unwrap();
    ((exponent << 9 | period_us >> exponent) as u16, period_us >> exponent << exponent)
}

proptest! {
    #[test]
    fn periods_come_back(period_us in 1_u32..=65_024) {
        let (content, told_us) = period_content(period_us);
        prop_assert_eq!(DshotReply::from_bits(checked(content)), Ok(DshotReply::Period(Some(told_us))));
        prop_assert!(period_us - told_us <= period_us / 256);
    }

    /// Replies are decoded from edges up to a third of a bit off, at a rate up to 4 % off, for any count of the timer,
    /// and from samples.
    #[test]
    fn replies_are_read(
        content in 0_u16..4_096, rate in 0.96..1.04_f64, bit in 20_u16..1_000, start in any::<u16>(),
        off in vec(-0.16..0.16_f64, EDGES_MAX), per_bit in 3_usize..=8, before in 0_usize..60, after in 0_usize..60,
    ) {
        let wanted = DshotReply::from_bits(checked(content)).unwrap();
        let levels = levels(checked(content));
        prop_assert_eq!(levels.len() as u32, REPLY_BITS);
        let times = edges(&levels, f64::from(bit) * rate);
        let times: Vec<u16> = times.iter().zip(&off).map(|(time, off)| {
            start.wrapping_add((time + off * f64::from(bit)).round() as i64 as u16)
        }).collect();
        prop_assert!(times.len() <= EDGES_MAX);
        prop_assert_eq!(DshotReply::from_edges(&times, bit), Ok(wanted));
        let taken = samples(&levels, per_bit, before, after);
        prop_assert_eq!(DshotReply::from_samples(taken, per_bit as u16), Ok(wanted));
    }

    /// Lines sampled together are decoded as if alone, for any signal on the others.
    #[test]
    fn lines_are_read_together(
        contents in prop::array::uniform4(0_u16..4_096), waits in prop::array::uniform4(0_usize..90),
        places in prop::sample::subsequence((0_u8..16).collect::<Vec<_>>(), 4), noise in vec(any::<u16>(), 192),
    ) {
        let alone: Vec<_> = contents.iter().zip(waits).map(|(content, before)| {
            samples(&levels(checked(*content)), 3, before, 192 - before - 63)
        }).collect();
        let places: [u8; 4] = places.try_into().unwrap();
        let used = places.iter().fold(0, |used, place| used | 1 << place);
        let together: Vec<u16> = noise.iter().enumerate().map(|(at, noise)| {
            places.iter().zip(&alone).fold(noise & !used, |all, (place, line)| all | u16::from(line[at]) << place)
        }).collect();
        let read = DshotReply::from_port(&together, places, 3);
        let wanted: Vec<_> = alone.into_iter().map(|line| DshotReply::from_samples(line, 3)).collect();
        prop_assert!(wanted.iter().all(Result::is_ok));
        prop_assert_eq!(read.to_vec(), wanted);
    }

    #[test]
    fn a_noisy_port_does_no_harm(samples in vec(any::<u16>(), 0..400), places: [u8; 4], per_bit in any::<u16>()) {
        let _ = DshotReply::from_port(&samples, places, per_bit);
    }

    /// A reply made for a speed has the content of its period.
    #[test]
    fn speeds_come_back(speed in 924_u32..2_000_000) {
        let bits = DshotReply::bits_of_speed(speed);
        let (content, told_us) = period_content(60_000_000 / speed);
        prop_assert_eq!(bits, checked(content));
        prop_assert_eq!(DshotReply::from_bits(bits).unwrap().speed_rev_min(), Some(60_000_000 / told_us));
        let line = DshotReply::line_of_bits(bits);
        let wanted = levels(bits).iter().fold(0, |line, level| line << 1 | u32::from(*level));
        prop_assert_eq!(line, wanted);
    }

    /// Noise causes no panic.
    #[test]
    fn noise_does_no_harm(
        edges in vec(any::<u16>(), 0..40), levels in vec(any::<bool>(), 0..300), bit in any::<u16>(),
    ) {
        let _ = DshotReply::from_edges(&edges, bit);
        let _ = DshotReply::from_samples(levels, bit);
    }
}

/// Every single wrong code bit is detected, in every reply. A single wrong level makes two code bits wrong. In about 5
/// of 1000 cases these form other valid groups with a matching checksum, which no receiver can detect.
#[test]
fn every_wrong_level_is_noticed() {
    let (mut tried, mut missed) = (0, 0);
    let code = |levels: &[bool]| levels.windows(2).fold(0_u32, |code, pair| code << 1 | u32::from(pair[0] != pair[1]));
    for content in 0..4_096 {
        let right = levels(checked(content));
        let wanted = DshotReply::from_bits(checked(content));
        assert_eq!(DshotReply::from_code(code(&right)), wanted);
        for bit in 0..REPLY_BITS - 1 {
            assert!(DshotReply::from_code(code(&right) ^ 1 << bit).is_err(), "{content:#x} {bit}");
        }
        for wrong in 1..right.len() {
            let mut line = right.clone();
            line[wrong] = !line[wrong];
            let times: Vec<u16> = edges(&line, 100.0).iter().map(|time| *time as u16).collect();
            tried += 1;
            let read = DshotReply::from_edges(&times, 100);
            missed += u32::from(read.is_ok() && read != wanted);
        }
    }
    assert_eq!((tried, missed), (81_920, 384));
}

#[test]
fn extended_telemetry_is_told_from_periods() {
    for (content, wanted) in [
        (0x000, DshotReply::Other(0, 0)),
        (0x22D, DshotReply::Temperature(45)),
        (0x43C, DshotReply::Voltage(60)),
        (0x611, DshotReply::Current(17)),
        (0x8AB, DshotReply::Other(4, 0xAB)),
        (0xE03, DshotReply::Other(7, 3)),
        (0xFFF, DshotReply::Period(None)),
        (0xFFE, DshotReply::Period(Some(510 << 7))),
        (0x1FF, DshotReply::Period(Some(511))),
        (0x300, DshotReply::Period(Some(256 << 1))),
    ] {
        assert_eq!(DshotReply::from_bits(checked(content)), Ok(wanted), "{content:#x}");
    }
}

#[test]
fn what_is_no_reply_is_refused() {
    assert_eq!(DshotReply::from_edges(&[], 100), Err(ReplyError::Timing));
    assert_eq!(DshotReply::from_edges(&[5], 100), Err(ReplyError::Group));
    assert_eq!(DshotReply::from_edges(&[5, 5], 100), Err(ReplyError::Timing));
    assert_eq!(DshotReply::from_edges(&[5, 105], 0), Err(ReplyError::Timing));
    assert_eq!(DshotReply::from_samples([true; 100], 5), Err(ReplyError::Timing));
    assert_eq!(DshotReply::from_samples((0..100).map(|at| at % 2 == 0), 1), Err(ReplyError::Timing));
    assert_eq!(DshotReply::from_bits(0), Err(ReplyError::Checksum));
    // A plain checksum belongs to a frame for a motor controller, not to its reply.
    assert_eq!(DshotReply::from_bits(0x1230), Err(ReplyError::Checksum));
    assert_eq!(DshotReply::from_code(0), Err(ReplyError::Group));
}

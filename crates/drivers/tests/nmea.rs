//! Fixes decoded from hand-written NMEA sentences.

use afbc_drivers::GnssReading;
use afbc_drivers::nmea::{NmeaDecoder, RANGE_SIGMA_M};
use proptest::prelude::*;

/// Adds the checksum to a sentence.
fn sentence(text: &str) -> String {
    format!("${text}*{:02X}\r\n", text.bytes().fold(0, |sum, byte| sum ^ byte))
}

/// Formats an angle as in NMEA, with the letter of its sign.
fn angle(degrees: f64, digits: usize, letters: [char; 2]) -> String {
    let ten_thousandths = (degrees.abs() * 60.0 * 1e5).round() as u64;
    let (whole, minutes) = (ten_thousandths / 6_000_000, ten_thousandths % 6_000_000);
    let letter = letters[usize::from(degrees < 0.0)];
    format!("{whole:0digits$}{:02}.{:05},{letter}", minutes / 100_000, minutes % 100_000)
}

fn epoch(time_s: f64, [latitude, longitude, altitude]: [f64; 3], speed_m_s: f64, course_deg: f64) -> String {
    let (h, m, s) = ((time_s / 3600.0) as u32, (time_s / 60.0) as u32 % 60, time_s % 60.0);
    let time = format!("{h:02}{m:02}{s:05.2}");
    let place = [angle(latitude, 2, ['N', 'S']), angle(longitude, 3, ['E', 'W'])].join(",");
    let knots = speed_m_s / 0.514_444;
    sentence(&format!("GNGGA,{time},{place},1,10,0.90,{altitude:.3},M,0.0,M,,"))
        + &sentence("GPGSV,1,1,01,05,45,120,40")
        + &sentence(&format!("GNRMC,{time},A,{place},{knots:.3},{course_deg:.2},251126,,,A"))
        + &sentence(&format!("GNVTG,{course_deg:.2},T,,M,{knots:.3},N,,K,A"))
}

/// Moves the sentence with speed and course to the front, as u-blox sends it.
fn motion_first(epoch: &str) -> String {
    let mut sentences: Vec<&str> = epoch.split_inclusive("\r\n").collect();
    sentences.rotate_right(2);
    sentences.concat()
}

fn fixes(decoder: &mut NmeaDecoder, text: &str) -> Vec<Option<GnssReading>> {
    text.bytes().filter_map(|byte| decoder.take(byte)).collect()
}

proptest! {
    /// Any position, speed and course is decoded correctly.
    #[test]
    fn what_is_sent_is_read(
        latitude in -89.0..89.0_f64, longitude in -179.9..179.9_f64, altitude in -400.0..8000.0_f64,
        speed in 0.0..50.0_f64, course in 0.0..359.9_f64, climb in -5.0..5.0_f64, time_s in 0.0..86_390.0,
        motion_comes_first in any::<bool>(),
    ) {
        let epoch = |time_s, place, speed, course| {
            let epoch = epoch(time_s, place, speed, course);
            if motion_comes_first { motion_first(&epoch) } else { epoch }
        };
        let time_s = f64::round(time_s);
        let mut decoder = NmeaDecoder::new();
        let before = epoch(time_s, [latitude, longitude, altitude], speed, course);
        prop_assert_eq!(fixes(&mut decoder, &before).len(), 1);
        let mut fix = None;
        for step in 1..=40 {
            let passed_s = 0.2 * f64::from(step);
            let place = [latitude, longitude, altitude + passed_s * climb];
            let read = fixes(&mut decoder, &epoch((time_s + passed_s) % 86_400.0, place, speed, course));
            prop_assert_eq!(read.len(), 1);
            fix = read[0];
        }
        let fix = fix.expect("a fix");
        prop_assert!((fix.latitude_deg - latitude).abs() < 1.1e-7 && (fix.longitude_deg - longitude).abs() < 1.1e-7);
        prop_assert!((fix.altitude_m - altitude - 8.0 * climb).abs() < 2e-3);
        let (east, north) = course.to_radians().sin_cos();
        prop_assert!((f64::from(fix.velocity_ned_m_s.x) - speed * north).abs() < 0.02);
        prop_assert!((f64::from(fix.velocity_ned_m_s.y) - speed * east).abs() < 0.02);
        let down = f64::from(fix.velocity_ned_m_s.z);
        prop_assert!((down + climb).abs() < 0.15, "{down} and {climb}");
        prop_assert!((fix.horizontal_sigma_m - 0.9 * RANGE_SIGMA_M).abs() < 1e-6);
        // The vertical speed is filtered from altitudes, so its standard deviation is larger.
        prop_assert!(fix.climb_sigma_m_s > fix.speed_sigma_m_s);
        prop_assert_eq!((fix.satellites, decoder.bad_sentences()), (10, 0));
    }

    /// A garbled line causes no panic, and no fix with impossible numbers.
    #[test]
    fn noise_is_survived(
        mut bytes in prop::collection::vec(any::<u8>(), 0..400), start in 0_usize..300, flip in any::<u8>(),
    ) {
        let good = epoch(45_000.0, [47.0, -8.5, 500.0], 3.0, 90.0);
        bytes.splice(start.min(bytes.len())..start.min(bytes.len()), good.bytes());
        let at = start % bytes.len();
        bytes[at] ^= flip;
        let mut decoder = NmeaDecoder::new();
        for fix in bytes.iter().filter_map(|byte| decoder.take(*byte)).flatten() {
            prop_assert!(fix.latitude_deg.abs() <= 90.0 && fix.longitude_deg.abs() <= 180.0);
            prop_assert!(fix.altitude_m.is_finite());
        }
        // A line that works again is read.
        let _ = fixes(&mut decoder, "\r\n");
        let again = epoch(45_001.0, [47.0, -8.5, 500.0], 3.0, 90.0) + &epoch(45_002.0, [47.0, -8.5, 500.0], 3.0, 90.0);
        prop_assert!(!fixes(&mut decoder, &again).is_empty());
    }

    /// Fields with any content and a correct checksum cause no panic.
    #[test]
    fn odd_fields_are_survived(text in "[0-9A-Z.,*$ -]{0,80}", kind in 0_usize..4) {
        let head = ["GNGGA", "GNRMC", "GPVTG", "GP"][kind];
        let mut decoder = NmeaDecoder::new();
        let _ = fixes(&mut decoder, &sentence(&format!("{head},{text}")));
        let _ = fixes(&mut decoder, &sentence(&format!("{head}{text}")));
    }
}

proptest! {
    /// Another decoder gives the same result, with any number of decimal places.
    #[test]
    fn another_reader_agrees(
        time_ms in 0_u32..86_400_000, [latitude, longitude] in [0_u64..5_400_000_000, 0..10_800_000_000],
        [south, west] in any::<[bool; 2]>(), altitude in -500.0..9000.0_f64, speed in 0.0..100.0_f64,
        course in prop::option::of(0.0..360.0_f64), dilution in 0.5..20.0_f64, satellites in 4_u8..40,
        places in 1_usize..=7,
    ) {
        let time = format!(
            "{:02}{:02}{:02}.{:03}", time_ms / 3_600_000, time_ms / 60_000 % 60, time_ms / 1000 % 60, time_ms % 1000
        );
        let angle = |number: u64, digits: usize| {
            let (degrees, minutes) = (number / 60_000_000, number % 60_000_000);
            let fraction = format!("{:06}0", minutes % 1_000_000);
            format!("{degrees:0digits$}{:02}.{}", minutes / 1_000_000, &fraction[..places])
        };
        let place = format!(
            "{},{},{},{}", angle(latitude, 2), ["N", "S"][usize::from(south)], angle(longitude, 3),
            ["E", "W"][usize::from(west)]
        );
        let course = course.map(|course| format!("{course:.2}")).unwrap_or_default();
        let fix = sentence(&format!("GPGGA,{time},{place},1,{satellites:02},{dilution:.2},{altitude:.2},M,47.0,M,,"));
        let motion = sentence(&format!("GPRMC,{time},A,{place},{speed:.3},{course},251126,,,A"));
        let Some(read) = fixes(&mut NmeaDecoder::new(), &(fix.clone() + &motion)).into_iter().next().flatten() else {
            return Err(TestCaseError::fail("no fix"));
        };

        let mut other = nmea0183::Parser::new();
        let all: Vec<_> = other.parse_from_bytes(fix.as_bytes()).collect();
        let Some(Ok(nmea0183::ParseResult::GGA(Some(fix)))) = all.into_iter().next() else {
            return Err(TestCaseError::fail("no GGA"));
        };
        prop_assert!((read.latitude_deg - fix.latitude.as_f64()).abs() < 1e-9);
        prop_assert!((read.longitude_deg - fix.longitude.as_f64()).abs() < 1e-9);
        let altitude_m = fix.altitude.map_or(f32::NAN, |altitude| altitude.meters);
        prop_assert!((read.altitude_m - f64::from(altitude_m)).abs() < 1e-3);
        prop_assert!((read.horizontal_sigma_m - fix.hdop * RANGE_SIGMA_M).abs() < 1e-4);
        prop_assert_eq!(read.satellites, fix.sat_in_use);
        let all: Vec<_> = other.parse_from_bytes(motion.as_bytes()).collect();
        let Some(Ok(nmea0183::ParseResult::RMC(Some(motion)))) = all.into_iter().next() else {
            return Err(TestCaseError::fail("no RMC"));
        };
        let (east, north) = motion.course.map_or(0.0, |course| course.degrees).to_radians().sin_cos();
        prop_assert!((read.velocity_ned_m_s.x - north * motion.speed.as_mps()).abs() < 1e-3);
        prop_assert!((read.velocity_ned_m_s.y - east * motion.speed.as_mps()).abs() < 1e-3);
    }
}

#[test]
fn numbers_that_are_none_spoil_no_fix() {
    for odd in ["inf", "-inf", "NaN", "1e39"] {
        let mut decoder = NmeaDecoder::new();
        let good = |time_s| epoch(time_s, [47.0, 8.0, 400.0], 1.0, 30.0);
        let bad = ["0.90", "400.000", "1.944", "30.00"].map(|number| {
            let sentences = good(1000.0);
            let changed = sentences.split_inclusive("\r\n").map(|whole| {
                let text = whole.trim_start_matches('$').split('*').next().expect("a text");
                sentence(&text.replace(number, odd))
            });
            changed.collect::<String>()
        });
        for (at, bad) in (0_u32..).zip(bad) {
            let time_s = 1001.0 + f64::from(at);
            let text = good(time_s - 0.6) + &bad + &good(time_s - 0.4) + &good(time_s - 0.2);
            let all: Vec<GnssReading> = fixes(&mut decoder, &text).into_iter().flatten().collect();
            assert!(all.len() >= 2, "{odd}: {all:?}");
            for fix in all {
                assert!(fix.velocity_ned_m_s.norm() < 2.0 && fix.horizontal_sigma_m < 3.0, "{odd}: {fix:?}");
            }
        }
    }
}

#[test]
fn epochs_that_do_not_belong_together_are_no_fix() {
    let mut decoder = NmeaDecoder::new();
    assert_eq!(fixes(&mut decoder, &sentence("GNGGA,,,,,,0,00,99.99,,,,,,")), [None]);
    let [early, late] = [1000.0, 1000.2].map(|time_s| epoch(time_s, [47.0, 8.0, 400.0], 1.0, 0.0));
    let (fix, _) = early.split_once("$GNRMC").expect("two halves");
    let (_, motion) = late.split_once("$GPGSV").expect("two halves");
    assert_eq!(fixes(&mut decoder, &format!("{fix}$GPGSV{motion}")), []);
}

/// Returns an epoch's sentences with the given quality fields. The position's sentence or the motion's comes first.
fn judged(quality: &str, dilution: &str, status: &str, mode: Option<&str>, motion_comes_first: bool) -> String {
    let place = "4807.03800,N,01131.00000,E";
    let mode = mode.map(|mode| format!(",{mode}")).unwrap_or_default();
    let epoch = sentence(&format!("GNGGA,123519.00,{place},{quality},08,{dilution},545.4,M,46.9,M,,"))
        + &sentence("GPGSV,1,1,01,05,45,120,40")
        + &sentence(&format!("GNRMC,123519.00,{status},{place},22.4,84.4,230394,,{mode}"))
        + &sentence("GPGLL,4807.03800,N,01131.00000,E,123519.00,A,A");
    if motion_comes_first { motion_first(&epoch) } else { epoch }
}

/// Dead reckoning, a manual position, a simulator's position and an invalid one are no fix, whichever of the two
/// sentences says so. The epoch is still reported, since a receiver without a fix is not silent.
#[test]
fn what_is_not_measured_is_no_fix() {
    let qualities = ["", "0", "1", "2", "3", "4", "5", "6", "7", "8", "9", "10", "A", "-1"];
    let modes = ["", "A", "D", "F", "P", "R", "E", "M", "N", "S", "X", "AA"].map(Some);
    for quality in qualities {
        // Receivers before NMEA 2.3 send no mode.
        for mode in modes.into_iter().chain([None]) {
            for (status, motion_comes_first) in [("A", false), ("A", true), ("V", false), ("V", true)] {
                let text = judged(quality, "0.9", status, mode, motion_comes_first);
                let read = fixes(&mut NmeaDecoder::new(), &text);
                let measured = ["1", "2", "3", "4", "5", "9"].contains(&quality)
                    && matches!(mode, None | Some("" | "A" | "D" | "F" | "P" | "R"))
                    && status == "A";
                assert!(!read.is_empty() && read.iter().all(|fix| fix.is_some() == measured), "{text}{read:?}");
            }
        }
    }
    // A receiver in a tunnel sent these sentences.
    let tunnel = "$GNGGA,123519.00,4807.038000,N,01131.000000,E,6,00,0.9,545.4,M,46.9,M,,*78\r\n\
        $GNRMC,123519.00,A,4807.038000,N,01131.000000,E,22.4,84.4,230394,,,E*48\r\n";
    assert_eq!(fixes(&mut NmeaDecoder::new(), tunnel).into_iter().flatten().count(), 0);
}

proptest! {
    /// A fix is refused if it is worse than 200 m, claims to be perfect, or is faster or higher than a receiver can
    /// report.
    #[test]
    fn impossible_numbers_are_an_epoch_without_a_fix(
        hundredths in prop_oneof![Just(0), 1_u32..12_000, Just(9_999)],
        knots in prop_oneof![0.0..950.0_f64, 0.0..3_000.0_f64],
        altitude in prop_oneof![-9_000.0..79_000.0_f64, -20_000.0..200_000.0_f64],
    ) {
        let place = "4807.03800,N,01131.00000,E";
        let text = sentence(&format!(
            "GNGGA,123519.00,{place},1,08,{}.{:02},{altitude:.1},M,46.9,M,,", hundredths / 100, hundredths % 100
        )) + &sentence(&format!("GNRMC,123519.00,A,{place},{knots:.1},0.0,230394,,,A"));
        let read = fixes(&mut NmeaDecoder::new(), &text);
        prop_assert_eq!(read.len(), 1);
        let vertical_m = 1.5 * RANGE_SIGMA_M * hundredths as f32 / 100.0;
        let speed_m_s = knots * 1852.0 / 3600.0;
        prop_assume!((vertical_m - 200.0).abs() > 0.1 && (speed_m_s - 500.0).abs() > 0.1);
        let possible = vertical_m > 0.0 && vertical_m <= 200.0 && speed_m_s <= 500.0
            && (-10_000.0..=80_000.0).contains(&altitude);
        prop_assert_eq!(read[0].is_some(), possible, "{}: {:?}", text, read);
    }

    /// Proprietary sentences begin with P, have any length, and may end like a known sentence.
    #[test]
    fn only_heads_of_a_talker_and_a_kind_are_read(head in "[A-Z0-9]{0,7}", kind in 0_usize..2) {
        let known = ["GGA", "RMC"][kind];
        let mut decoder = NmeaDecoder::new();
        for text in [head.clone(), format!("P{head}{known}"), format!("{head}{known}")] {
            let talks = text.len() == 5 && text.ends_with(known) && !text.starts_with('P')
                && text.bytes().take(2).all(|byte| byte.is_ascii_uppercase());
            // A sentence without a valid fix is the shortest one that the decoder reports.
            let read = fixes(&mut decoder, &sentence(&format!("{text},123519.00,V,,,,0,,")));
            prop_assert_eq!(read.len(), usize::from(talks), "{}", text);
        }
        prop_assert_eq!(decoder.bad_sentences(), 0);
    }
}

/// A proprietary sentence within an epoch is not taken for RMC.
#[test]
fn a_proprietary_sentence_spoils_no_epoch() {
    let good = judged("1", "0.9", "A", Some("A"), false);
    let own = sentence("PGRMC,A,218.8,100,6378137.000,298.257223563,0.0,0.0,0.0,A,3,1,1,4,30");
    let mixed = good.replace("$GPGSV", &format!("{own}$GPGSV")).replace("$GPGLL", &format!("{own}$GPGLL"));
    let mut decoder = NmeaDecoder::new();
    assert_eq!(fixes(&mut decoder, &mixed), fixes(&mut NmeaDecoder::new(), &good));
    assert_eq!(decoder.bad_sentences(), 0);
}

/// After bytes of another protocol a sentence begins anew: what had come of one before is neither whole nor damaged.
#[test]
fn a_sentence_begins_anew_after_another_protocol() {
    let whole = sentence("GPGSV,1,1,01,05,45,120,40");
    let (first, rest) = whole.split_at(12);
    let mut decoder = NmeaDecoder::new();
    let counts = |decoder: &NmeaDecoder| (decoder.good_sentences(), decoder.bad_sentences());
    assert_eq!(fixes(&mut decoder, first), []);
    decoder.begin();
    assert_eq!((fixes(&mut decoder, rest), counts(&decoder)), (vec![], (0, 0)));
    assert_eq!((fixes(&mut decoder, &whole), counts(&decoder)), (vec![], (1, 0)));
}

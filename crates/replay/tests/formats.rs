//! ULogs of other versions, by other writers, damaged in one place, or made to take long: each is converted to MCAP and
//! replayed.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs, reason = "tests")]

mod common;

use afbc_replay::mcap::{McapSummary, convert};
use afbc_replay::read;
use common::{BOOT_US, Kind, Ulog, file, log, records};
use std::fmt::Write as _;
use std::io::Cursor;

/// Converts a log; returns its counts, and the first and the last time in the MCAP file \[us\].
fn converted(name: &str, bytes: &[u8]) -> Result<(McapSummary, [u64; 2]), String> {
    let mut mcap = Vec::new();
    let summary = convert(&file(name, bytes), Cursor::new(&mut mcap)).map_err(|error| error.to_string())?;
    let times = mcap::MessageStream::new(&mcap).unwrap().map(|message| message.unwrap().log_time / 1000);
    let ends = times.fold([u64::MAX, 0], |[first, last], time_us| [first.min(time_us), last.max(time_us)]);
    Ok((summary, ends))
}

fn short() -> Vec<u8> {
    log(&Kind { duration_s: 3.0, rate_hz: 100, ..Kind::default() })
}

/// In ULog, incompatible flag 0 means appended data. A reader must refuse a file with any flag that it does not know.
#[test]
fn every_unknown_incompatible_flag_is_refused_as_a_newer_format() {
    let whole = short();
    for bit in 1..64 {
        let mut newer = whole.clone();
        // The flags follow the header, the record's head and the compatible flags.
        newer[16 + 3 + 8 + bit / 8] |= 1 << (bit % 8);
        let refused = [
            converted("newer.ulg", &newer).unwrap_err(),
            read(&file("newer.ulg", &newer)).map(|_| ()).unwrap_err().to_string(),
        ];
        for error in refused {
            assert!(error.contains("newer.ulg: the log's format is newer than this program"), "{error}");
            assert!(error.contains(&format!("{:#x}", 1_u64 << bit)) && error.lines().count() == 1, "{error}");
        }
        // Compatible flags do not matter.
        let mut known = whole.clone();
        known[16 + 3 + bit / 8] |= 1 << (bit % 8);
        assert_eq!(converted("known.ulg", &known).unwrap(), converted("whole.ulg", &whole).unwrap());
    }
}

/// Version 0 has no flags record, and a log may have no parameters.
#[test]
fn logs_without_flags_or_parameters_are_read_whole() {
    let whole = short();
    let expected = converted("whole.ulg", &whole).unwrap();
    assert_eq!(expected.0.damaged, 0);
    let samples = |name: &str, bytes: &[u8]| read(&file(name, bytes)).unwrap().imu.len();
    for (version, left_out) in [(0, "B"), (1, "P"), (0, "BP"), (1, "BP"), (1, "B")] {
        let mut other = whole[..16].to_vec();
        other[7] = version;
        for (kind, from, to) in records(&whole) {
            if !left_out.as_bytes().contains(&kind) {
                other.extend(&whole[from..to]);
            }
        }
        let name = format!("version-{version}-without-{left_out}.ulg");
        assert_eq!(converted(&name, &other).unwrap(), expected, "{name}");
        assert_eq!(samples(&name, &other), samples("whole.ulg", &whole), "{name}");
    }
}

/// A logger dies within a record, and after the next start appends to the same file.
#[test]
fn appended_data_are_read() {
    let whole = short();
    let all = records(&whole);
    let cut = all[all.len() / 2];
    let (before, after) = (cut.1 + (cut.2 - cut.1) / 2, all[all.len() * 3 / 4].1);
    let mut appended = [&whole[..before], &whole[after..]].concat();
    appended[16 + 3 + 8] = 1;
    appended[16 + 3 + 16..][..8].copy_from_slice(&(before as u64).to_le_bytes());
    let lost = all.iter().filter(|(kind, from, _)| *kind == b'D' && (cut.1..after).contains(from)).count() as u64;
    let (expected, found) = (converted("one.ulg", &whole).unwrap().0, converted("appended.ulg", &appended).unwrap().0);
    assert!(found.damaged == 1 && expected.messages > found.messages, "{found:?}");
    // Each position message also makes a frame.
    assert!(expected.messages - found.messages <= 2 * lost, "{expected:?} {found:?} {lost}");
    // Impossible offsets are ignored.
    let mut odd = whole.clone();
    odd[16 + 3 + 8] = 1;
    for (place, byte) in odd[16 + 3 + 16..][..24].iter_mut().enumerate() {
        *byte = 0xff - place as u8;
    }
    assert_eq!(converted("odd.ulg", &odd).unwrap().0, expected);
}

/// One wrong time costs one message, and the file stays as long as the flight.
#[test]
fn a_flipped_time_makes_no_file_of_centuries() {
    let whole = short();
    let (expected, [first, last]) = converted("times.ulg", &whole).unwrap();
    let data: Vec<_> = records(&whole).into_iter().filter(|(kind, ..)| *kind == b'D').collect();
    for (index, (_, from, _)) in data.iter().enumerate().step_by(data.len() / 12) {
        for bit in 0..64 {
            let mut flipped = whole.clone();
            flipped[from + 5 + bit / 8] ^= 1 << (bit % 8);
            let (found, [from, to]) = converted("flipped.ulg", &flipped).unwrap();
            assert!(to <= last + 61_000_000 && from <= first, "bit {bit} of {index}: {from} to {to}");
            assert!(found.damaged <= 1 && found.messages + 2 >= expected.messages, "bit {bit} of {index}: {found:?}");
        }
    }
    // A slow topic's last value may be as old as the vehicle's uptime.
    let mut old = whole.clone();
    old[data[0].1 + 5..][..8].copy_from_slice(&7_u64.to_le_bytes());
    assert_eq!(converted("old.ulg", &old).unwrap(), (expected, [7, last]));
    assert!(first > BOOT_US);
}

/// A format that names an undeclared one costs only its own topic.
#[test]
fn a_damaged_format_costs_its_own_topic() {
    let whole = short();
    let expected = converted("whole.ulg", &whole).unwrap().0;
    for broken in
        ["lost:uint64_t timestamp;nowhere[2] part;", "lost:lost own;", "lost:float", "lost:", ":float x", "\u{e9}"]
    {
        // Insert the broken format after the flags record.
        let (head, rest) = whole.split_at(16 + 43);
        let mut log = Ulog::new();
        log.bytes = head.to_vec();
        log.record(b'F', broken.as_bytes());
        log.bytes.extend(rest);
        let found = converted("broken.ulg", &log.bytes).unwrap().0;
        assert_eq!((found.messages, found.topics), (expected.messages, expected.topics), "{broken}");
        assert!(found.damaged <= 1, "{broken}");
    }
}

/// Writes a log with these formats, `times` subscriptions, and two messages for each.
fn declared(formats: &[String], times: u16) -> Vec<u8> {
    let mut log = Ulog::new();
    formats.iter().for_each(|format| log.record(b'F', format.as_bytes()));
    for index in 0..times {
        let name = formats[usize::from(index) % formats.len()].split(':').next().unwrap().to_owned();
        let id = log.subscribe(&name, (index / 256) as u8);
        log.record(b'D', &[&id.to_le_bytes()[..], &[0; 8]].concat());
        log.record(b'D', &id.to_le_bytes());
    }
    log.bytes
}

/// A few bytes declare very long messages. Each log would take minutes, or all memory, if it were laid out as declared.
#[test]
fn what_would_take_for_ever_does_not() {
    let nested = |count: usize, many: &str| -> Vec<String> {
        let inner = |index: usize| format!("m{index}:uint64_t timestamp;m{}{many} part;", index + 1);
        (0..count).map(inner).chain([format!("m{count}:uint64_t timestamp;")]).collect()
    };
    let empty: Vec<String> = (0..8).map(|index| format!("m{index}:m{}[32767] part;", index + 1)).collect();
    let mut wide = "w:uint64_t timestamp;".to_owned();
    (0..5000).for_each(|index| write!(wide, "float f{index};").unwrap());
    let long = format!("l:uint8_t[60000] {};", "x".repeat(60_000));
    let wide_ones: Vec<String> = (0..300).map(|index| wide.replacen("w:", &format!("w{index}:"), 1)).collect();
    for (name, formats, times) in [
        ("deep", nested(3000, ""), 3000),
        ("deep-arrays", nested(3000, "[9]"), 3000),
        ("empty", [empty, vec!["m8:".into()]].concat(), 8),
        ("wide", vec![wide], 60_000),
        ("many-wide", wide_ones, 3000),
        ("long", vec![long], 1000),
        ("own", vec!["a:a[200] part;a[200] other;".into()], 1000),
        ("huge", vec!["a:uint8_t[9999999999] x;".into(), "b:uint8_t[65000] x;uint8_t[65000] y;".into()], 1000),
    ] {
        let bytes = declared(&formats, times);
        let is_told = match converted(&format!("{name}.ulg"), &bytes) {
            Ok((found, _)) => found.damaged > 0,
            Err(error) => error.contains("no message can be read: all messages are damaged"),
        };
        assert!(is_told, "{name}");
        read(&file(&format!("{name}.ulg"), &bytes)).map(|_| ()).unwrap_err();
    }
    // Seven levels of nesting are read.
    let mut log = Ulog::new();
    nested(6, "[2]").iter().for_each(|format| log.record(b'F', format.as_bytes()));
    let id = log.subscribe("m0", 0);
    log.record(b'D', &[&id.to_le_bytes()[..], &[1; 8 * 127]].concat());
    assert_eq!(converted("seven.ulg", &log.bytes).unwrap().0, McapSummary { topics: 1, messages: 1, damaged: 0 });
}

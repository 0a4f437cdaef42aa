//! MCAP files by other programs: intact, damaged, and built to take a long time.
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, missing_docs, reason = "tests")]

use afbc_plot::LogColumns;
use mcap::WriteOptions;
use mcap::records::MessageHeader;
use proptest::prelude::*;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::io::Cursor;
use std::path::PathBuf;

/// Returns an MCAP file with messages of one topic at intervals of one millisecond.
fn file(schema: &str, encoding: &str, messages: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let mut writer = WriteOptions::new().compression(None).create(&mut bytes).unwrap();
    let schema = writer.add_schema("pkg/msg/Kind", "ros2msg", schema.as_bytes()).unwrap();
    let channel_id = writer.add_channel(schema, "/topic", encoding, &BTreeMap::new()).unwrap();
    for (sequence, message) in (0..).zip(messages) {
        let log_time = 1_000_000 * u64::from(sequence);
        let header = MessageHeader { channel_id, sequence, log_time, publish_time: log_time };
        writer.write_to_known_channel(&header, message).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    bytes.into_inner()
}

/// Returns a message in the Common Data Representation, little-endian.
fn message(body: &[u8]) -> Vec<u8> {
    [&[0, 1, 0, 0], body].concat()
}

fn path(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("mcap");
    fs::create_dir_all(&folder).unwrap();
    folder.join(format!("{name}-{:?}.mcap", std::thread::current().id()))
}

/// Writes `bytes` to a file and reads it. A refusal must be one line that names the file.
fn read(name: &str, bytes: &[u8]) -> Option<LogColumns> {
    let path = path(name);
    fs::write(&path, bytes).unwrap();
    match LogColumns::read(&path) {
        Ok(log) => Some(log),
        Err(error) => {
            let error = error.to_string();
            assert!(error.contains(&path.display().to_string()) && error.lines().count() == 1, "{error}");
            None
        }
    }
}

const SCHEMA: &str = "uint8 kind\nfloat64[2] values\npkg/Part part\nstring<=9 name\nint16[] more\n\
    ================\nMSG: pkg/Part\nfloat32 share\nbool is_there\n";

fn body(kind: u8, more: &[i16]) -> Vec<u8> {
    // Each number is aligned to its size.
    let mut body = vec![kind, 0, 0, 0, 0, 0, 0, 0];
    [1.5_f64, -2.5].iter().for_each(|value| body.extend(value.to_le_bytes()));
    body.extend(0.25_f32.to_le_bytes());
    body.extend([1, 0, 0, 0]);
    body.extend(3_u32.to_le_bytes());
    body.extend(*b"ab\0\0");
    body.extend((more.len() as u32).to_le_bytes());
    more.iter().for_each(|value| body.extend(value.to_le_bytes()));
    body
}

#[test]
fn numbers_are_where_the_schema_has_them() {
    let messages: Vec<_> = (0..3).map(|kind| message(&body(kind, &[7, -8]))).collect();
    let log = read("whole", &file(SCHEMA, "cdr", &messages)).unwrap();
    let names = ["time_s", "kind", "values[0]", "values[1]", "part.share", "part.is_there", "more[0]", "more[1]"];
    let full = |name: &str| log.names().into_iter().find(|known| known.ends_with(name)).unwrap();
    assert_eq!(log.names().len(), names.len(), "{:?}", log.names());
    for (name, last) in names.iter().zip([0.002, 2.0, 1.5, -2.5, 0.25, 1.0, 7.0, -8.0]) {
        let points = log.points(&full("time_s"), &full(name)).unwrap();
        assert_eq!(points[&None].last(), Some(&(0.002, last)), "{name}");
    }
}

/// Huge numbers of nested messages are read quickly.
#[test]
fn what_would_take_for_ever_does_not() {
    // Seven levels of a hundred fields each, whose innermost messages are empty.
    let mut deep = String::new();
    for depth in 0..8 {
        if depth > 0 {
            write!(deep, "================\nMSG: pkg/D{depth}\n").unwrap();
        }
        (0..100).for_each(|field| writeln!(deep, "pkg/D{} f{field}", depth + 1).unwrap());
    }
    deep.push_str("================\nMSG: pkg/D8\n");
    let many = "uint8[4294967295] bytes\n";
    let empty = "pkg/Empty[4294967295] none\nuint8 kind\n================\nMSG: pkg/Empty\n";
    let own = "pkg/Kind again\nuint8 kind\n";
    for (name, schema) in [("deep", deep.as_str()), ("many", many), ("empty", empty), ("own", own)] {
        let messages = vec![message(&[1; 64]); 3];
        read(name, &file(schema, "cdr", &messages));
    }
    assert!(read("other", &file(SCHEMA, "protobuf", &[message(&[])])).is_none());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// A file with some bytes replaced, and cut anywhere, is either read or refused in one line.
    #[test]
    fn damage_is_borne(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..20), cut: prop::sample::Index,
    ) {
        let messages: Vec<_> = (0..20).map(|kind| message(&body(kind, &[1, 2, 3]))).collect();
        let mut bytes = file(SCHEMA, "cdr", &messages);
        for (place, byte) in changes {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        bytes.truncate(cut.index(bytes.len()).max(9));
        read("damaged", &bytes);
    }

    /// Any schema with any messages is read or refused in one line.
    #[test]
    fn any_messages_are_borne(
        schema in "((bool|float32|float64|int64|string|pkg/Kind|time)(\\[\\]|\\[[0-9]{1,9}\\])? [a-c]\n){0,6}",
        messages in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..80), 0..6),
    ) {
        read("any", &file(&schema, "cdr", &messages));
    }
}

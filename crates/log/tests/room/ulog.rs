//! Reads the parts of a log that these tests need, by the specification (PX4 User Guide, "ULog File Format").

use std::collections::BTreeMap;

/// Content of a log up to its last whole record.
#[derive(Debug, Default)]
pub(crate) struct ReadLog {
    /// Length of all whole records \[bytes\].
    pub(crate) whole: usize,
    /// Times of the inertial samples \[us\].
    pub(crate) samples_us: Vec<u64>,
    /// Durations of dropouts \[ms\], each with the number of samples before it.
    pub(crate) dropouts: Vec<(u64, usize)>,
    /// Parameters changed after the log's beginning.
    pub(crate) changes: Vec<(String, f32)>,
    pub(crate) texts: Vec<String>,
}

fn number(bytes: &[u8]) -> u64 {
    bytes.iter().rev().fold(0, |number, byte| number << 8 | u64::from(*byte))
}

/// Returns the offset and length of a field in a format \[bytes\].
fn place(format: &str, name: &str) -> (usize, usize) {
    let mut at = 0;
    for field in format.split(';').filter(|field| !field.is_empty()) {
        let (kind, called) = field.split_once(' ').unwrap();
        let (kind, values) = kind
            .split_once('[')
            .map_or((kind, 1), |(kind, values)| (kind, values.trim_end_matches(']').parse().unwrap()));
        let size = match kind {
            "uint64_t" | "double" => 8,
            "uint32_t" | "int32_t" | "float" => 4,
            "uint16_t" => 2,
            _ => 1,
        };
        if called == name {
            return (at, size);
        }
        at += size * values;
    }
    panic!("{format} has no {name}");
}

/// Reads a log.
pub(crate) fn read(bytes: &[u8]) -> ReadLog {
    let mut log = ReadLog::default();
    if bytes.len() < 16 {
        return log;
    }
    assert_eq!(&bytes[..7], b"ULog\x01\x12\x35");
    log.whole = 16;
    let (mut formats, mut sensor, mut in_data) = (BTreeMap::new(), None, false);
    while let Some([low, high, kind]) = bytes.get(log.whole..log.whole + 3) {
        let length = usize::from(u16::from_le_bytes([*low, *high]));
        let Some(content) = bytes.get(log.whole + 3..log.whole + 3 + length) else { break };
        in_data |= b"ADLSO".contains(kind);
        assert!(if in_data { b"ADLSOP" } else { b"BFIMPQ" }.contains(kind), "{kind} does not belong there");
        match kind {
            b'F' => {
                let (topic, format) = std::str::from_utf8(content).unwrap().split_once(':').unwrap();
                formats.insert(topic.to_owned(), format.to_owned());
            }
            b'A' if &content[3..] == b"sensor_combined" => sensor = Some(number(&content[1..3])),
            b'D' if sensor == Some(number(&content[..2])) => {
                // A message's time is the end of its integration. Its sample is valid half an integration time earlier.
                let (at, size) = place(&formats["sensor_combined"], "gyro_integral_dt");
                let behind_us = number(&content[2 + at..2 + at + size]) / 2;
                log.samples_us.push(number(&content[2..10]) - behind_us);
            }
            b'O' => log.dropouts.push((number(content), log.samples_us.len())),
            b'L' => log.texts.push(std::str::from_utf8(&content[9..]).unwrap().to_owned()),
            b'P' if in_data => {
                let (key, value) = content[1..].split_at(usize::from(content[0]));
                let name = std::str::from_utf8(key).unwrap().split_once(' ').unwrap().1.to_owned();
                log.changes.push((name, f32::from_le_bytes(value.try_into().unwrap())));
            }
            _ => (),
        }
        log.whole += 3 + length;
    }
    log
}

//! Reads ULog by its specification (PX4 User Guide, "ULog File Format"), and panics at anything that is not allowed.

use std::collections::BTreeMap;

/// A field: its type, number of values if it is an array, and name.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FieldFormat {
    pub(crate) kind: String,
    pub(crate) values: Option<usize>,
    pub(crate) name: String,
}

/// Content of a log.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct StrictLog {
    pub(crate) start_us: u64,
    pub(crate) formats: BTreeMap<String, Vec<FieldFormat>>,
    pub(crate) information: BTreeMap<String, Vec<u8>>,
    /// Names and values in the order of the log, beginning with those in the definitions.
    pub(crate) parameters: Vec<(String, f64)>,
    /// Number of parameters in the definitions.
    pub(crate) initial: usize,
    pub(crate) defaults: Vec<(String, f64)>,
    /// Messages by topic: the time, and the values of all other fields.
    pub(crate) messages: BTreeMap<String, Vec<(u64, Vec<f64>)>>,
    pub(crate) texts: Vec<(u8, u64, String)>,
    /// Duration of each dropout \[ms\], with the number of messages of each topic before it.
    pub(crate) dropouts: Vec<(u64, BTreeMap<String, usize>)>,
    pub(crate) syncs: usize,
    /// Number of records.
    pub(crate) records: usize,
    /// Length of all whole records \[bytes\].
    pub(crate) whole: usize,
}

impl StrictLog {
    /// Returns the values of a field in all messages of a topic.
    pub(crate) fn field(&self, topic: &str, name: &str) -> Vec<f64> {
        let mut place = 0;
        let mut found = None;
        for field in &self.formats[topic][1..] {
            let (plain, index) = name
                .split_once('[')
                .map_or((name, 0), |(plain, index)| (plain, index.trim_end_matches(']').parse().unwrap()));
            if field.name == plain {
                assert!(index < field.values.unwrap_or(1), "{topic}: {name}");
                found = Some(place + index);
            }
            place += field.values.unwrap_or(1);
        }
        let place = found.unwrap_or_else(|| panic!("{topic} has no {name}"));
        self.messages.get(topic).into_iter().flatten().map(|(_, values)| values[place]).collect()
    }

    /// Returns the times of all messages of a topic.
    pub(crate) fn times(&self, topic: &str) -> Vec<u64> {
        self.messages.get(topic).into_iter().flatten().map(|(at_us, _)| *at_us).collect()
    }
}

fn size(kind: &str) -> usize {
    match kind {
        "int8_t" | "uint8_t" | "bool" | "char" => 1,
        "int16_t" | "uint16_t" => 2,
        "int32_t" | "uint32_t" | "float" => 4,
        "int64_t" | "uint64_t" | "double" => 8,
        other => panic!("no type: {other}"),
    }
}

fn number(kind: &str, bytes: &[u8]) -> f64 {
    match kind {
        "int8_t" => f64::from(bytes[0] as i8),
        "bool" => {
            assert!(bytes[0] < 2, "no bool: {}", bytes[0]);
            f64::from(bytes[0])
        }
        "uint8_t" | "char" => f64::from(bytes[0]),
        "int16_t" => f64::from(i16::from_le_bytes(bytes.try_into().unwrap())),
        "uint16_t" => f64::from(u16::from_le_bytes(bytes.try_into().unwrap())),
        "int32_t" => f64::from(i32::from_le_bytes(bytes.try_into().unwrap())),
        "uint32_t" => f64::from(u32::from_le_bytes(bytes.try_into().unwrap())),
        "float" => f64::from(f32::from_le_bytes(bytes.try_into().unwrap())),
        "double" => f64::from_le_bytes(bytes.try_into().unwrap()),
        "uint64_t" => u64::from_le_bytes(bytes.try_into().unwrap()) as f64,
        other => panic!("no type: {other}"),
    }
}

fn name(text: &str) -> &str {
    assert!(!text.is_empty() && text.bytes().all(|c| c.is_ascii_alphanumeric() || c == b'_'), "no name: {text}");
    text
}

pub(crate) fn fields(format: &str) -> Vec<FieldFormat> {
    let parts = format.strip_suffix(';').unwrap_or_else(|| panic!("no end: {format}")).split(';');
    let field = |part: &str| {
        let (kind, called) = part.trim().split_once(' ').unwrap();
        let (kind, values) = match kind.split_once('[') {
            Some((kind, values)) => (kind, Some(values.strip_suffix(']').unwrap().parse().unwrap())),
            None => (kind, None),
        };
        FieldFormat { kind: kind.to_owned(), values, name: name(called).to_owned() }
    };
    parts.map(field).collect()
}

/// Replaces each field of a nested format by that format's fields, such as `esc.1.esc_rpm` in the second `esc`.
fn flat(fields: Vec<FieldFormat>, formats: &BTreeMap<String, Vec<FieldFormat>>) -> Vec<FieldFormat> {
    let flat = |field: FieldFormat| {
        let Some(inner) = formats.get(&field.kind) else {
            size(&field.kind);
            return vec![field];
        };
        let one = |at: usize| {
            let named = |part: &FieldFormat| format!("{}.{at}.{}", field.name, part.name);
            inner.iter().map(|part| FieldFormat { name: named(part), ..part.clone() }).collect::<Vec<_>>()
        };
        (0..field.values.unwrap_or(1)).flat_map(one).collect()
    };
    fields.into_iter().flat_map(flat).collect()
}

/// Returns the name and value of a parameter.
fn parameter(content: &[u8]) -> (String, f64) {
    let (length, rest) = content.split_first().unwrap();
    let (key, value) = rest.split_at(usize::from(*length));
    let (kind, called) = std::str::from_utf8(key).unwrap().split_once(' ').unwrap();
    assert!(["float", "int32_t"].contains(&kind), "{kind}");
    assert_eq!(value.len(), 4);
    (name(called).to_owned(), number(kind, value))
}

/// Reads a log up to its last whole record. Panics at anything that is not allowed.
pub(crate) fn read(bytes: &[u8]) -> StrictLog {
    let mut log = StrictLog::default();
    if bytes.len() < 16 {
        return log;
    }
    assert_eq!(&bytes[..8], b"ULog\x01\x12\x35\x01");
    log.start_us = u64::from_le_bytes(bytes[8..16].try_into().unwrap());
    log.whole = 16;
    let mut topics: BTreeMap<u16, String> = BTreeMap::new();
    let mut in_data = false;
    while let Some(head) = bytes.get(log.whole..log.whole + 3) {
        let length = usize::from(u16::from_le_bytes([head[0], head[1]]));
        let Some(content) = bytes.get(log.whole + 3..log.whole + 3 + length) else { break };
        let kind = head[2];
        assert!(log.records > 0 || kind == b'B', "flags come first");
        if b"ADLSO".contains(&kind) && !in_data {
            in_data = true;
            log.initial = log.parameters.len();
        }
        assert!(!in_data || b"ADLSOP".contains(&kind), "a definition among the data: {}", char::from(kind));
        match kind {
            b'B' => assert!(log.records == 0 && content == [0; 40]),
            b'I' => {
                let (key, value) = content[1..].split_at(usize::from(content[0]));
                let key = std::str::from_utf8(key).unwrap();
                let [field] = fields(&format!("{key};")).try_into().unwrap();
                assert_eq!(value.len(), size(&field.kind) * field.values.unwrap_or(1), "{key}");
                assert!(log.information.insert(field.name, value.to_owned()).is_none(), "{key} twice");
            }
            b'F' => {
                let (topic, format) = std::str::from_utf8(content).unwrap().split_once(':').unwrap();
                let fields = flat(fields(format), &log.formats);
                assert_eq!((fields[0].kind.as_str(), fields[0].name.as_str()), ("uint64_t", "timestamp"), "{topic}");
                assert!(log.formats.insert(name(topic).to_owned(), fields).is_none(), "{topic} twice");
            }
            b'P' => log.parameters.push(parameter(content)),
            b'Q' => {
                assert_eq!(content[0], 1);
                log.defaults.push(parameter(&content[1..]));
            }
            b'A' => {
                assert_eq!(content[0], 0, "one instance of each");
                let topic = std::str::from_utf8(&content[3..]).unwrap().to_owned();
                assert!(log.formats.contains_key(&topic), "{topic} without a format");
                let id = u16::from_le_bytes([content[1], content[2]]);
                assert!(topics.insert(id, topic).is_none(), "{id} twice");
            }
            b'D' => {
                let topic = &topics[&u16::from_le_bytes([content[0], content[1]])];
                let mut rest = &content[2..];
                let mut values = Vec::new();
                for field in &log.formats[topic] {
                    for _ in 0..field.values.unwrap_or(1) {
                        let (value, behind) = rest.split_at(size(&field.kind));
                        values.push(number(&field.kind, value));
                        rest = behind;
                    }
                }
                assert!(rest.is_empty(), "{topic}: {} bytes too many", rest.len());
                let at_us = values.remove(0) as u64;
                let messages = log.messages.entry(topic.clone()).or_default();
                assert!(messages.last().is_none_or(|(last_us, _)| *last_us <= at_us), "{topic} goes back in time");
                messages.push((at_us, values));
            }
            b'L' => {
                assert!((b'0'..=b'7').contains(&content[0]));
                let at_us = u64::from_le_bytes(content[1..9].try_into().unwrap());
                log.texts.push((content[0] - b'0', at_us, String::from_utf8(content[9..].to_vec()).unwrap()));
            }
            b'S' => {
                assert_eq!(content, [0x2f, 0x73, 0x13, 0x20, 0x25, 0x0c, 0xbb, 0x12]);
                log.syncs += 1;
            }
            b'O' => {
                let before = log.messages.iter().map(|(topic, messages)| (topic.clone(), messages.len())).collect();
                log.dropouts.push((u64::from(u16::from_le_bytes(content.try_into().unwrap())), before));
            }
            other => panic!("no record: {}", char::from(other)),
        }
        log.records += 1;
        log.whole += 3 + length;
    }
    if !in_data {
        log.initial = log.parameters.len();
    }
    log
}

//! Reads MCAP files with ROS 2 messages (CDR, schemas in `ros2msg`). ULog files are converted to MCAP first.

use crate::table::LogTable;
use ::mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use ::mcap::{Channel, McapError, MessageStream};
use afbc_files::read::FileError;
use std::collections::{BTreeMap, HashMap};
use std::io::Cursor;
use std::path::Path;
use std::sync::Arc;

/// Name of the column with the time since the log's first message \[s\].
const TIME: &str = "time_s";
/// Deepest nesting of messages, and most elements of an array that become columns.
const DEPTH: usize = 8;
const LONGEST: usize = 64;
/// Largest number of fields of a message that are read, including those of nested messages. Ten fields at each of eight
/// levels would be 10^8.
const FIELDS: u32 = 100_000;

/// Reads a ULog file.
pub(crate) fn read_ulog(path: &Path) -> Result<Vec<LogTable>, FileError> {
    let mut bytes = Vec::new();
    afbc_replay::mcap::convert(path, Cursor::new(&mut bytes))?;
    read(&bytes).map_err(|problem| FileError::whole(&path.display().to_string(), problem))
}

/// Reads the topics of an MCAP file. Topics in another encoding are left out.
pub(crate) fn read(bytes: &[u8]) -> Result<Vec<LogTable>, String> {
    let mut topics: BTreeMap<u16, Option<(TopicLayout, TopicColumns)>> = BTreeMap::new();
    let mut start = None;
    let mut others = Vec::new();
    for message in MessageStream::new(bytes).map_err(refused)? {
        let message = message.map_err(refused)?;
        let start = *start.get_or_insert(message.log_time);
        let channel = &message.channel;
        let known = topics.entry(channel.id).or_insert_with(|| {
            let layout = TopicLayout::of(channel);
            if layout.is_none() {
                others.push(channel.topic.clone());
            }
            layout.map(|layout| (layout, TopicColumns::default()))
        });
        if let Some((layout, topic)) = known {
            let time_s = (message.log_time as f64 - start as f64) / 1e9;
            topic.add(time_s, layout.values(&message.data));
        }
    }
    let tables: Vec<LogTable> =
        topics.into_values().flatten().map(|(layout, topic)| topic.table(layout.topic)).collect();
    if tables.iter().all(|table| table.numbers.len() < 2) {
        return Err(format!(
            "the file has no topic in ROS 2's encoding (cdr, ros2msg); its topics are {}; record in that encoding",
            others.join(", ")
        ));
    }
    Ok(tables)
}

/// Checks by the file's checksums that it is complete and undamaged.
pub(crate) fn check(mut bytes: &[u8]) -> Result<(), String> {
    let options = LinearReaderOptions::default().with_validate_chunk_crcs(true).with_validate_data_section_crc(true);
    let mut reader = LinearReader::new_with_options(options);
    while let Some(event) = reader.next_event() {
        if let LinearReadEvent::ReadRequest(wanted) = event.map_err(refused)? {
            let (now, rest) = bytes.split_at(wanted.min(bytes.len()));
            reader.insert(now.len()).copy_from_slice(now);
            reader.notify_read(now.len());
            bytes = rest;
        }
    }
    Ok(())
}

/// Says why a file is refused, and what helps. A damaged or cut file is never drawn in part.
fn refused(error: McapError) -> String {
    match error {
        McapError::UnsupportedCompression(by) => {
            format!(
                "the file is compressed by {by}; give an uncompressed file, as `mcap compress --compression none` \
                 writes it"
            )
        }
        McapError::UnexpectedEof | McapError::UnexpectedEoc | McapError::BadFooter => {
            "the file ends within a record; copy it again, or repair it with `mcap recover`".into()
        }
        error => format!("the file is damaged ({error}); copy it again, or repair it with `mcap recover`"),
    }
}

/// Columns of a topic while the file is read.
#[derive(Default)]
struct TopicColumns {
    times_s: Vec<f64>,
    columns: Vec<(String, Vec<f64>)>,
    /// Index in `columns` of each name.
    places: HashMap<String, usize>,
}

impl TopicColumns {
    fn add(&mut self, time_s: f64, values: Vec<(String, f64)>) {
        let before = self.times_s.len();
        self.times_s.push(time_s);
        for (place, (name, value)) in values.into_iter().enumerate() {
            // Fast path: most messages have the same fields in the same order.
            let known = self.columns.get(place).filter(|(known, _)| *known == name).map(|_| place);
            let known = known.or_else(|| self.places.get(&name).copied()).unwrap_or_else(|| {
                self.places.insert(name.clone(), self.columns.len());
                self.columns.push((name, Vec::new()));
                self.columns.len() - 1
            });
            if let Some((_, column)) = self.columns.get_mut(known) {
                column.resize(before, f64::NAN);
                column.push(value);
            }
        }
    }

    fn table(mut self, topic: String) -> LogTable {
        let length = self.times_s.len();
        self.columns.iter_mut().for_each(|(_, column)| column.resize(length, f64::NAN));
        let numbers = [(TIME.to_owned(), self.times_s)].into_iter().chain(self.columns).collect();
        LogTable { topic, numbers, words: Vec::new() }
    }
}

/// Field layout of a topic's messages.
struct TopicLayout {
    topic: String,
    /// Fields of each message type, by the last part of its name; the topic's own message has the empty name.
    messages: BTreeMap<String, Vec<FieldLayout>>,
}

#[derive(Clone)]
struct FieldLayout {
    name: String,
    kind: String,
    /// Length of an array, or `Some(0)` for a sequence; `None` for a single value.
    many: Option<usize>,
}

impl TopicLayout {
    fn of(channel: &Arc<Channel<'_>>) -> Option<Self> {
        let schema = channel.schema.as_ref()?;
        if channel.message_encoding != "cdr" || schema.encoding != "ros2msg" {
            return None;
        }
        let text = std::str::from_utf8(&schema.data).ok()?;
        let mut messages = BTreeMap::from([(String::new(), Vec::new())]);
        let mut current = String::new();
        for line in text.lines() {
            let line = line.split('#').next().unwrap_or_default().trim();
            if let Some(name) = line.strip_prefix("MSG:") {
                current = last(name.trim()).to_owned();
                messages.insert(current.clone(), Vec::new());
            } else if let Some((kind, rest)) = line.split_once(char::is_whitespace)
                && let Some(fields) = messages.get_mut(&current)
            {
                // A constant ("=") takes no space in the message. A default value follows the name and is ignored.
                let name = rest.split_whitespace().next().unwrap_or_default();
                if !rest.contains('=') && !name.is_empty() {
                    fields.push(FieldLayout::new(kind, name));
                }
            }
        }
        Some(TopicLayout { topic: channel.topic.trim_start_matches('/').to_owned(), messages })
    }

    /// Returns the numbers of a message with their names. Stops at the end of the data or at an unknown type.
    fn values(&self, data: &[u8]) -> Vec<(String, f64)> {
        let mut values = Vec::new();
        // The first four bytes give the encoding; the second is odd for little-endian.
        if let Some((head, body)) = data.split_at_checked(4)
            && head.get(1).is_some_and(|kind| kind % 2 == 1)
        {
            let mut reader = CdrReader { bytes: body, at: 0, fields: FIELDS };
            let _partly = self.message("", "", &mut reader, &mut values, 0);
        }
        values
    }

    fn message(
        &self,
        kind: &str,
        prefix: &str,
        reader: &mut CdrReader<'_>,
        values: &mut Vec<(String, f64)>,
        depth: usize,
    ) -> Option<()> {
        for field in self.messages.get(kind).filter(|_| depth < DEPTH)? {
            let count = match field.many {
                Some(0) => reader.number("uint32")? as usize,
                Some(count) => count,
                None => 1,
            };
            for index in 0..count {
                reader.fields = reader.fields.checked_sub(1)?;
                let before = reader.at;
                let name = match field.many {
                    Some(_) => format!("{prefix}{}[{index}]", field.name),
                    None => format!("{prefix}{}", field.name),
                };
                match field.kind.as_str() {
                    "string" => reader.text()?,
                    known if size(known).is_some() => {
                        let value = reader.number(known)?;
                        if index < LONGEST {
                            values.push((name, value));
                        }
                    }
                    other => self.message(last(other), &format!("{name}."), reader, values, depth + 1)?,
                }
                // Elements without any bytes hold no numbers: stop, however many the message announces.
                if reader.at == before {
                    break;
                }
            }
        }
        Some(())
    }
}

impl FieldLayout {
    fn new(kind: &str, name: &str) -> Self {
        let (kind, many) = match kind.split_once('[') {
            // `[3]` is an array; `[]` and `[<=3]` are sequences.
            Some((kind, count)) => (kind, Some(count.trim_end_matches(']').parse().unwrap_or(0))),
            None => (kind, None),
        };
        // A string type may have a maximum length: `string<=9`.
        let kind = if kind.starts_with("string") { "string" } else { kind };
        FieldLayout { name: name.into(), kind: kind.into(), many }
    }
}

/// Returns the last part of a message type's name.
fn last(name: &str) -> &str {
    name.rsplit('/').next().unwrap_or(name)
}

/// Returns the size of a numeric type \[bytes\]; `None` for other types.
fn size(kind: &str) -> Option<usize> {
    Some(match kind {
        "bool" | "byte" | "char" | "int8" | "uint8" => 1,
        "int16" | "uint16" => 2,
        "int32" | "uint32" | "float32" => 4,
        "int64" | "uint64" | "float64" => 8,
        // Two 32-bit numbers, seconds and nanoseconds, read as one number of seconds.
        "time" | "duration" | "builtin_interfaces/Time" | "builtin_interfaces/Duration" => 8,
        _ => return None,
    })
}

/// Reads the body of a message in the Common Data Representation, version 1.
struct CdrReader<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Number of fields that may still be read.
    fields: u32,
}

impl CdrReader<'_> {
    /// Returns the next number, which is aligned to its size.
    fn number(&mut self, kind: &str) -> Option<f64> {
        let length = size(kind)?;
        let is_time = kind.ends_with("ime") || kind.ends_with("uration");
        self.at = self.at.next_multiple_of(if is_time { 4 } else { length });
        let from = self.bytes.get(self.at..self.at.checked_add(length)?)?;
        self.at += length;
        macro_rules! take {
            ($type:ty) => {
                <$type>::from_le_bytes(*from.first_chunk()?)
            };
        }
        Some(match kind {
            "bool" | "byte" | "char" | "uint8" => take!(u8).into(),
            "int8" => take!(i8).into(),
            "int16" => take!(i16).into(),
            "uint16" => take!(u16).into(),
            "int32" => take!(i32).into(),
            "uint32" => take!(u32).into(),
            "float32" => take!(f32).into(),
            "int64" => take!(i64) as f64,
            "uint64" => take!(u64) as f64,
            "float64" => take!(f64),
            _ => {
                let (seconds, fraction) = from.split_first_chunk()?;
                f64::from(i32::from_le_bytes(*seconds)) + f64::from(u32::from_le_bytes(*fraction.first_chunk()?)) / 1e9
            }
        })
    }

    /// Skips a string: its length and its bytes.
    fn text(&mut self) -> Option<()> {
        let length = self.number("uint32")? as usize;
        self.at = self.at.checked_add(length).filter(|end| *end <= self.bytes.len())?;
        Some(())
    }
}

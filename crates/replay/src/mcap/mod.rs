//! Converts a ULog to [MCAP](https://mcap.dev) for Foxglove, PlotJuggler, Rerun and ROS 2's tools.
//!
//! Each topic of the log becomes one topic of the file, with the same fields, units and frames. Messages are encoded as
//! in ROS 2 (CDR, schema in `ros2msg`). Messages that these tools draw without any setup are added: frames of the
//! vehicle and its setpoint, the vehicle's place on a map, and its texts.

mod ros;
mod times;
mod topic;

use crate::ulog::{FilePiece, LogReader, UlogEntry, UlogSubscription, UlogValue, each, is_ulog};
use afbc_files::read::FileError;
use cdr_encoding::to_vec;
use mcap::records::{MessageHeader, Metadata};
use mcap::{McapError, WriteOptions, Writer};
use ros::{RosLog, RosMessage, RosParameterChange, SceneAttitudes};
use serde::Serialize;
use std::collections::{BTreeMap, HashMap};
use std::fs;
use std::io::{Seek, Write};
use std::path::Path;
use topic::McapTopic;

/// Counts of a converted log.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct McapSummary {
    /// Number of topics with messages.
    pub topics: usize,
    /// Number of messages.
    pub messages: u64,
    /// Number of damaged pieces of the log, which the file lacks.
    pub damaged: u64,
}

/// Converts the ULog at `path`.
///
/// # Errors
/// One line, if the log cannot be read, is not a ULog, or `to` cannot be written.
pub fn convert(path: &Path, to: impl Write + Seek) -> Result<McapSummary, FileError> {
    let failed = |problem: String| FileError::whole(&path.display().to_string(), problem);
    let bytes =
        fs::read(path).map_err(|error| failed(format!("the log cannot be read ({error}); give the path of a log")))?;
    if !is_ulog(&bytes) {
        return Err(failed("this is not a ULog; give a log written by --ulog or by PX4".into()));
    }
    write(&bytes, to).map_err(failed)
}

/// Writes the log in `bytes` to `to` as MCAP.
fn write(bytes: &[u8], to: impl Write + Seek) -> Result<McapSummary, String> {
    // The file is not compressed, since the compressors are C code.
    let library = concat!("sitl ", env!("CARGO_PKG_VERSION"));
    let options = WriteOptions::new().compression(None).profile("ros2").library(library);
    let writer = options.create(to).map_err(unwritten)?;
    let mut conversion = Conversion {
        output: McapWriter { writer, channels: HashMap::new(), messages: 0, failure: None },
        topics: HashMap::new(),
        scene: SceneAttitudes::default(),
        now_us: 0,
        parameters: BTreeMap::new(),
        information: BTreeMap::new(),
    };
    let mut ahead = times::ahead(&times_us(bytes)?).into_iter();
    let mut damaged = 0;
    entries(bytes, |entry| {
        let entry = entry.filter(|entry| time_us(entry).is_none() || ahead.next() != Some(true));
        damaged += u64::from(entry.is_none());
        entry.into_iter().for_each(|entry| conversion.take(entry));
    })?;
    conversion.finish(damaged)
}

/// Calls `take` with the content of each record; with none for a damaged one.
fn entries(bytes: &[u8], mut take: impl FnMut(Option<UlogEntry<'_>>)) -> Result<(), String> {
    let mut reader = LogReader::default();
    each(bytes, |piece, _| match piece {
        FilePiece::Record(record) => take(reader.entry(record)),
        FilePiece::Junk(_) => take(None),
    })
    .map(drop)
}

/// Returns the time of a record, if it has one \[us\].
fn time_us(entry: &UlogEntry<'_>) -> Option<u64> {
    match entry {
        UlogEntry::Message { topic, data, .. } => topic::time_us(&topic.format, data),
        UlogEntry::Text { time_us, .. } => Some(*time_us),
        _ => None,
    }
}

/// Returns the times of all records that have one \[us\].
fn times_us(bytes: &[u8]) -> Result<Vec<u64>, String> {
    let mut times_us = Vec::new();
    entries(bytes, |entry| times_us.extend(entry.as_ref().and_then(time_us)))?;
    Ok(times_us)
}

fn unwritten(error: McapError) -> String {
    format!("the MCAP file cannot be written ({error}); free some space")
}

/// A conversion in progress: what was read so far, and the file being written.
struct Conversion<W: Write + Seek> {
    output: McapWriter<W>,
    /// Topics of the log by their ids.
    topics: HashMap<u16, McapTopic>,
    scene: SceneAttitudes,
    /// Time of the last message that had one \[us\].
    now_us: u64,
    /// Parameters at the log's beginning.
    parameters: BTreeMap<String, String>,
    information: BTreeMap<String, String>,
}

impl<W: Write + Seek> Conversion<W> {
    fn take(&mut self, entry: UlogEntry<'_>) {
        self.now_us = time_us(&entry).unwrap_or(self.now_us);
        match entry {
            UlogEntry::Message { id, topic, data } => self.message(id, topic, data),
            UlogEntry::Parameter { name, value, is_initial } => self.parameter(name, value, is_initial),
            UlogEntry::Information { kind, name, value } => self.information(kind, name, value),
            UlogEntry::Text { time_us, level, text } => {
                let shown = RosLog::of(time_us, level, &text);
                self.output.put(RosLog::TOPIC, [RosLog::KIND, RosLog::SCHEMA], self.now_us, &shown);
            }
            UlogEntry::Dropout(lost_ms) => self.dropout(lost_ms),
            UlogEntry::Other => {}
        }
    }

    fn message(&mut self, id: u16, topic: &UlogSubscription, data: &[u8]) {
        let known = self.topics.entry(id).or_insert_with(|| McapTopic::of(topic));
        self.output.put(&known.name, [&known.kind, &known.schema], self.now_us, &known.sample(data));
        if let Some(RosMessage { topic, kind, schema, content }) = self.scene.update(&topic.format, data) {
            self.output.put(topic, [kind, schema], self.now_us, &content);
        }
    }

    fn parameter(&mut self, name: &str, value: UlogValue, is_initial: bool) {
        if is_initial {
            self.parameters.insert(name.to_owned(), value.to_string());
        } else {
            let change = RosParameterChange { name: name.to_owned(), value: value.number() };
            let schema = [RosParameterChange::KIND, RosParameterChange::SCHEMA];
            self.output.put(RosParameterChange::TOPIC, schema, self.now_us, &change);
        }
    }

    fn information(&mut self, kind: &str, name: &str, value: &[u8]) {
        if kind.starts_with("char") {
            let value = String::from_utf8_lossy(value);
            self.information.insert(name.to_owned(), value.trim_end_matches('\0').to_owned());
        }
    }

    /// Writes a dropout at the time of the last message: a dropout has no time of its own.
    fn dropout(&mut self, duration_ms: u16) {
        let schema = ["afbc_msgs/msg/Dropout", "uint16 duration_ms\n"];
        self.output.put("/dropout", schema, self.now_us, &duration_ms);
    }

    fn finish(self, damaged: u64) -> Result<McapSummary, String> {
        let Self { mut output, parameters, information, .. } = self;
        if let Some(failure) = output.failure {
            return Err(unwritten(failure));
        }
        if output.messages == 0 {
            let why = if damaged == 0 { "the log ends before the first message" } else { "all messages are damaged" };
            return Err(format!("no message can be read: {why}; copy the log from the vehicle again"));
        }
        for (name, metadata) in [("parameters", parameters), ("information", information)] {
            output.writer.write_metadata(&Metadata { name: name.to_owned(), metadata }).map_err(unwritten)?;
        }
        output.writer.finish().map_err(unwritten)?;
        Ok(McapSummary { topics: output.channels.len(), messages: output.messages, damaged })
    }
}

/// The MCAP file being written.
struct McapWriter<W: Write + Seek> {
    writer: Writer<W>,
    /// Channel and number of messages of each topic that has any.
    channels: HashMap<String, (u16, u32)>,
    /// Number of messages of all topics.
    messages: u64,
    /// The first error in writing; nothing is written after it.
    failure: Option<McapError>,
}

impl<W: Write + Seek> McapWriter<W> {
    /// Writes a message of a topic; `schema` holds the schema's name and text.
    fn put(&mut self, topic: &str, schema: [&str; 2], time_us: u64, content: &impl Serialize) {
        if self.failure.is_none() {
            self.failure = self.try_put(topic, schema, time_us, content).err();
        }
    }

    fn try_put(
        &mut self,
        topic: &str,
        [kind, schema]: [&str; 2],
        time_us: u64,
        content: &impl Serialize,
    ) -> Result<(), McapError> {
        if !self.channels.contains_key(topic) {
            let schema = self.writer.add_schema(kind, "ros2msg", schema.as_bytes())?;
            let channel = self.writer.add_channel(schema, topic, "cdr", &BTreeMap::new())?;
            self.channels.insert(topic.to_owned(), (channel, 0));
        }
        let Some((channel_id, sequence)) = self.channels.get_mut(topic) else { return Ok(()) };
        // CDR data begin with a header that says little-endian.
        let mut bytes = vec![0, 1, 0, 0];
        let content = to_vec::<_, byteorder::LittleEndian>(content);
        bytes.extend(content.map_err(|error| McapError::Io(std::io::Error::other(error)))?);
        let time_ns = time_us.saturating_mul(1000);
        let header =
            MessageHeader { channel_id: *channel_id, sequence: *sequence, log_time: time_ns, publish_time: time_ns };
        *sequence = sequence.wrapping_add(1);
        self.messages += 1;
        self.writer.write_to_known_channel(&header, &bytes)
    }
}

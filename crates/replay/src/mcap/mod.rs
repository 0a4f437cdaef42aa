//! A ULog as [MCAP](https://mcap.dev), for Foxglove, PlotJuggler, Rerun and ROS 2's tools.
//!
//! Each topic of the log is one of the file, with the same fields, units and frames, as ROS 2 writes messages (CDR,
//! schema in `ros2msg`). Added is what such tools draw by themselves: the vehicle and its setpoint as frames, its
//! place on a map, its texts.

mod ros;
mod topic;

use crate::ulog::{HEADER, Piece, each, is_ulog};
use afbc_reader::FileError;
use cdr_encoding::to_vec;
use mcap::records::{MessageHeader, Metadata};
use mcap::{McapError, WriteOptions, Writer};
use px4_ulog::stream_parser::LogParser;
use px4_ulog::stream_parser::model::{
    DataMessage, DropoutMessage, InfoMessage, LogStage, LoggedStringMessage, ParameterMessage,
    TaggedLoggedStringMessage,
};
use ros::{ParameterChange, RosMessage, Scene, ShownText};
use serde::Serialize;
use std::cell::RefCell;
use std::collections::{BTreeMap, HashMap};
use std::fs;
use std::io::{Seek, Write};
use std::path::Path;
use topic::McapTopic;

/// What a converted log holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct McapSummary {
    /// Topics with messages.
    pub topics: usize,
    /// Messages in all.
    pub messages: u64,
    /// Pieces of the log that are damaged, and missing.
    pub damaged: u64,
}

/// Converts the ULog at `path`.
///
/// # Errors
/// One line, if it cannot be read, is not a ULog, or `to` cannot be written.
pub fn convert(path: &Path, to: impl Write + Seek) -> Result<McapSummary, FileError> {
    let failed = |problem: String| FileError::whole(&path.display().to_string(), problem);
    let bytes = fs::read(path).map_err(|error| failed(format!("cannot be read ({error}); give the path of a log")))?;
    if !is_ulog(&bytes) {
        return Err(failed("this is not a ULog; give a log of --ulog or of PX4".into()));
    }
    write(&bytes, to).map_err(failed)
}

/// Writes the log in `bytes`.
fn write(bytes: &[u8], to: impl Write + Seek) -> Result<McapSummary, String> {
    // Not compressed: the compressors are in C.
    let library = concat!("sitl ", env!("CARGO_PKG_VERSION"));
    let options = WriteOptions::new().compression(None).profile("ros2").library(library);
    let writer = options.create(to).map_err(unwritten)?;
    // Borrowed by one callback of the parser at a time: none of them calls another.
    let conversion = RefCell::new(Conversion {
        output: Output { writer, channels: HashMap::new(), messages: 0, failure: None },
        topics: HashMap::new(),
        scene: Scene::default(),
        now_us: 0,
        damaged: 0,
        parameters: BTreeMap::new(),
        information: BTreeMap::new(),
    });
    let mut on_data = |message: &DataMessage<'_>| conversion.borrow_mut().data(message);
    let mut on_text = |text: &LoggedStringMessage<'_>| {
        conversion.borrow_mut().text(text.timestamp, text.log_level, text.logged_message);
    };
    let mut on_tagged_text = |text: &TaggedLoggedStringMessage<'_>| {
        conversion.borrow_mut().text(text.timestamp, text.log_level, text.logged_message);
    };
    let mut on_parameter = |parameter: &ParameterMessage<'_>| conversion.borrow_mut().parameter(parameter);
    let mut on_information = |information: &InfoMessage<'_>| conversion.borrow_mut().information(information);
    let mut on_dropout = |dropout: &DropoutMessage| conversion.borrow_mut().dropout(dropout);
    let mut parser = LogParser::default();
    parser.set_data_message_callback(&mut on_data);
    parser.set_logged_string_message_callback(&mut on_text);
    parser.set_tagged_logged_string_message_callback(&mut on_tagged_text);
    parser.set_parameter_message_callback(&mut on_parameter);
    parser.set_info_message_callback(&mut on_information);
    parser.set_dropout_message_callback(&mut on_dropout);
    let header = bytes.get(..HEADER).ok_or("cut within the first 16 bytes; copy it from the vehicle again")?;
    parser.consume_bytes(header).map_err(|error| error.description)?;
    let mut damaged = 0;
    each(bytes, |piece, _| {
        let is_read = matches!(piece, Piece::Record(record) if parser.consume_bytes(record).is_ok());
        damaged += u64::from(!is_read);
    });
    drop(parser);
    let mut conversion = conversion.into_inner();
    conversion.damaged += damaged;
    conversion.finish()
}

fn unwritten(error: McapError) -> String {
    format!("the MCAP file cannot be written ({error}); make room")
}

/// What is read of the log, and the file that is written.
struct Conversion<W: Write + Seek> {
    output: Output<W>,
    /// Topics of the log, by their ids.
    topics: HashMap<u16, McapTopic>,
    scene: Scene,
    /// Time of the last message that had one \[us\].
    now_us: u64,
    /// Messages that are too short.
    damaged: u64,
    /// Those at the log's beginning.
    parameters: BTreeMap<String, String>,
    information: BTreeMap<String, String>,
}

impl<W: Write + Seek> Conversion<W> {
    fn data(&mut self, message: &DataMessage<'_>) {
        let topic = self.topics.entry(message.msg_id).or_insert_with(|| McapTopic::of(message));
        let Some(sample) = topic.sample(message.data) else {
            self.damaged += 1;
            return;
        };
        self.now_us = sample.time_us.unwrap_or(self.now_us);
        self.output.put(&topic.name, [&topic.kind, &topic.schema], self.now_us, &sample);
        if let Some(RosMessage { topic, kind, schema, content }) =
            self.scene.update(message.flattened_format, message.data)
        {
            self.output.put(topic, [kind, schema], self.now_us, &content);
        }
    }

    fn text(&mut self, time_us: u64, level: u8, text: &str) {
        self.now_us = time_us;
        let shown = ShownText::of(time_us, level, text);
        self.output.put(ShownText::TOPIC, [ShownText::KIND, ShownText::SCHEMA], self.now_us, &shown);
    }

    fn parameter(&mut self, parameter: &ParameterMessage<'_>) {
        let (name, value, shown, stage) = match parameter {
            ParameterMessage::Float(name, value, stage) => (*name, f64::from(*value), value.to_string(), stage),
            ParameterMessage::Int32(name, value, stage) => (*name, f64::from(*value), value.to_string(), stage),
        };
        if *stage == LogStage::Definitions {
            self.parameters.insert(name.to_owned(), shown);
        } else {
            let change = ParameterChange { name: name.to_owned(), value };
            let schema = [ParameterChange::KIND, ParameterChange::SCHEMA];
            self.output.put(ParameterChange::TOPIC, schema, self.now_us, &change);
        }
    }

    fn information(&mut self, information: &InfoMessage<'_>) {
        if information.type_str.starts_with("char") {
            let value = String::from_utf8_lossy(information.value);
            self.information.insert(information.key.to_owned(), value.trim_end_matches('\0').to_owned());
        }
    }

    /// A dropout has no time of its own: it ends with the next message.
    fn dropout(&mut self, dropout: &DropoutMessage) {
        let schema = ["afbc_msgs/msg/Dropout", "uint16 duration_ms\n"];
        self.output.put("/dropout", schema, self.now_us, &dropout.duration_ms);
    }

    fn finish(self) -> Result<McapSummary, String> {
        let Self { mut output, damaged, parameters, information, .. } = self;
        if let Some(failure) = output.failure {
            return Err(unwritten(failure));
        }
        for (name, metadata) in [("parameters", parameters), ("information", information)] {
            output.writer.write_metadata(&Metadata { name: name.to_owned(), metadata }).map_err(unwritten)?;
        }
        output.writer.finish().map_err(unwritten)?;
        Ok(McapSummary { topics: output.channels.len(), messages: output.messages, damaged })
    }
}

/// The file that is written.
struct Output<W: Write + Seek> {
    writer: Writer<W>,
    /// Channel and number of messages of each topic that has any.
    channels: HashMap<String, (u16, u32)>,
    /// Number of messages in all.
    messages: u64,
    /// Why nothing more can be written.
    failure: Option<McapError>,
}

impl<W: Write + Seek> Output<W> {
    /// Writes a message of a topic with that kind and schema.
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
        // CDR begins with its kind: little-endian.
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

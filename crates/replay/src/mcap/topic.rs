//! A topic of the log as one of ROS 2's: the same fields in the same order.

use px4_ulog::stream_parser::model::{DataMessage, FlattenedField, FlattenedFieldType as Type};
use serde::ser::{Serialize, SerializeTuple, Serializer};
use std::collections::HashSet;
use std::fmt::Write as _;

/// A topic, and where its fields lie in a message of the log.
pub(super) struct McapTopic {
    /// Name, with a slash first; that of a further instance has its number behind.
    pub(super) name: String,
    /// Name of its schema.
    pub(super) kind: String,
    /// Fields, as `ros2msg`.
    pub(super) schema: String,
    places: Vec<(Type, usize)>,
    timestamp: Option<usize>,
}

/// A message: its values in the order of the schema.
pub(super) struct McapSample<'a> {
    /// Its time since power-up \[us\], if it has one.
    pub(super) time_us: Option<u64>,
    places: &'a [(Type, usize)],
    data: &'a [u8],
}

impl McapTopic {
    /// Returns the topic of a message.
    pub(super) fn of(message: &DataMessage<'_>) -> Self {
        let format = message.flattened_format;
        let fields: Vec<_> =
            // A writer of ULog aligns its fields by these, which a reader has to leave out.
            format.field_iter().filter(|field| !field.flattened_field_name.starts_with("_padding")).collect();
        let name = match message.multi_id.value() {
            0 => format!("/{}", format.message_name()),
            instance => format!("/{}/{instance}", format.message_name()),
        };
        let package = if format.message_name().starts_with("afbc_") { "afbc_msgs" } else { "px4_msgs" };
        McapTopic {
            name,
            kind: format!("{package}/msg/{}", type_name(format.message_name())),
            schema: schema(&fields),
            places: fields.iter().map(|field| (field.field_type.clone(), usize::from(field.offset))).collect(),
            timestamp: format.timestamp_field.as_ref().map(|field| usize::from(field.offset)),
        }
    }

    /// Returns a message; none if it is too short for its fields.
    pub(super) fn sample<'a>(&'a self, data: &'a [u8]) -> Option<McapSample<'a>> {
        let is_whole = |(kind, at): &(Type, usize)| data.len() >= at + size(kind);
        let time =
            |at: usize| data.get(at..).and_then(|from| from.first_chunk()).map(|bytes| u64::from_le_bytes(*bytes));
        let sample = McapSample { time_us: self.timestamp.and_then(time), places: &self.places, data };
        self.places.iter().all(is_whole).then_some(sample)
    }
}

impl Serialize for McapSample<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut tuple = serializer.serialize_tuple(self.places.len())?;
        for (kind, at) in self.places {
            let from = self.data.get(*at..).unwrap_or_default();
            macro_rules! put {
                ($type:ty) => {
                    tuple.serialize_element(&<$type>::from_le_bytes(from.first_chunk().copied().unwrap_or_default()))?
                };
            }
            match kind {
                Type::Int8 => put!(i8),
                Type::UInt8 | Type::Char => put!(u8),
                Type::Bool => tuple.serialize_element(&from.first().is_some_and(|byte| *byte != 0))?,
                Type::Int16 => put!(i16),
                Type::UInt16 => put!(u16),
                Type::Int32 => put!(i32),
                Type::UInt32 => put!(u32),
                Type::Int64 => put!(i64),
                Type::UInt64 => put!(u64),
                Type::Float => put!(f32),
                Type::Double => put!(f64),
            }
        }
        tuple.end()
    }
}

/// Returns the length of a value \[bytes\].
fn size(kind: &Type) -> usize {
    match kind {
        Type::Int8 | Type::UInt8 | Type::Bool | Type::Char => 1,
        Type::Int16 | Type::UInt16 => 2,
        Type::Int32 | Type::UInt32 | Type::Float => 4,
        Type::Int64 | Type::UInt64 | Type::Double => 8,
    }
}

/// Returns what ROS 2 calls a type.
fn ros_type(kind: &Type) -> &'static str {
    match kind {
        Type::Int8 => "int8",
        Type::UInt8 | Type::Char => "uint8",
        Type::Bool => "bool",
        Type::Int16 => "int16",
        Type::UInt16 => "uint16",
        Type::Int32 => "int32",
        Type::UInt32 => "uint32",
        Type::Int64 => "int64",
        Type::UInt64 => "uint64",
        Type::Float => "float32",
        Type::Double => "float64",
    }
}

/// Returns the fields as `ros2msg`: `q[0]`, `q[1]` and so on are an array again, and a field of a part, `esc[0].rpm`,
/// has a name in one piece, `esc_0_rpm`.
fn schema(fields: &[&FlattenedField]) -> String {
    let mut schema = String::new();
    let mut names = HashSet::new();
    let mut rest = fields;
    while let [first, ..] = rest {
        let length = array(rest);
        let name = match length {
            1 => &first.flattened_field_name,
            _ => first.flattened_field_name.trim_end_matches("[0]"),
        };
        let name = unlike(field_name(name), &mut names);
        let length_of = if length == 1 { String::new() } else { format!("[{length}]") };
        // Writing to a string cannot fail.
        let _ = writeln!(schema, "{}{length_of} {name}", ros_type(&first.field_type));
        rest = rest.get(length..).unwrap_or_default();
    }
    schema
}

/// Returns the number of values of the array that the fields begin with; 1 if it is none.
fn array(fields: &[&FlattenedField]) -> usize {
    let [first, ..] = fields else { return 1 };
    let Some(name) = first.flattened_field_name.strip_suffix("[0]") else { return 1 };
    let belongs = |(index, field): &(usize, &&FlattenedField)| {
        field.flattened_field_name == format!("{name}[{index}]") && field.field_type == first.field_type
    };
    fields.iter().enumerate().take_while(belongs).count().max(1)
}

/// Returns a name as fields of ROS 2 may have it: letters in lower case, digits, single underscores between them.
fn field_name(name: &str) -> String {
    let words = name.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    let name = words.map(str::to_ascii_lowercase).collect::<Vec<_>>().join("_");
    if name.starts_with(|c: char| c.is_ascii_lowercase()) { name } else { format!("field_{name}") }
}

/// Returns a name as types of ROS 2 may have it: `VehicleAttitude`.
fn type_name(name: &str) -> String {
    let words = name.split(|c: char| !c.is_ascii_alphanumeric());
    let capital = |word: &str| {
        let mut letters = word.chars();
        letters.next().map(|first| first.to_ascii_uppercase().to_string() + letters.as_str()).unwrap_or_default()
    };
    let name: String = words.map(capital).collect();
    if name.starts_with(|c: char| c.is_ascii_uppercase()) { name } else { format!("Topic{name}") }
}

/// Returns the name, or one with a number behind it that is not among the `names` yet.
fn unlike(name: String, names: &mut HashSet<String>) -> String {
    let numbered = (2_u32..).map(|number| format!("{name}_{number}"));
    let free = std::iter::once(name.clone()).chain(numbered).find(|name| !names.contains(name)).unwrap_or(name);
    names.insert(free.clone());
    free
}

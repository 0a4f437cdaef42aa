//! Converts a topic of the log to a topic of ROS 2 with the same fields in the same order.

use crate::ulog::{FieldType as Type, MessageField, UlogFormat, UlogSubscription};
use serde::ser::{Serialize, SerializeTuple, Serializer};
use std::collections::HashSet;
use std::fmt::Write as _;

/// A topic and the offsets of its fields in a message of the log.
pub(super) struct McapTopic {
    /// Name after a slash; a second or later instance has its number appended.
    pub(super) name: String,
    /// Name of the schema.
    pub(super) kind: String,
    /// Fields in the format `ros2msg`.
    pub(super) schema: String,
    places: Vec<(Type, usize)>,
}

/// A message, whose values are written in the order of the schema.
pub(super) struct McapSample<'a> {
    places: &'a [(Type, usize)],
    data: &'a [u8],
}

/// Returns the time of a message since power-up, if it has one \[us\].
pub(super) fn time_us(format: &UlogFormat, data: &[u8]) -> Option<u64> {
    data.get(format.timestamp()?..)?.first_chunk().map(|bytes| u64::from_le_bytes(*bytes))
}

impl McapTopic {
    /// Makes the topic of the file for a topic of the log.
    pub(super) fn of(topic: &UlogSubscription) -> Self {
        let format = &topic.format;
        let name = match topic.instance {
            0 => format!("/{}", format.name),
            instance => format!("/{}/{instance}", format.name),
        };
        let package = if format.name.starts_with("afbc_") { "afbc_msgs" } else { "px4_msgs" };
        McapTopic {
            name,
            kind: format!("{package}/msg/{}", type_name(&format.name)),
            schema: schema(&format.fields),
            places: format.fields.iter().map(|field| (field.kind, field.at)).collect(),
        }
    }

    /// Makes a message of this topic from the log's bytes.
    pub(super) fn sample<'a>(&'a self, data: &'a [u8]) -> McapSample<'a> {
        McapSample { places: &self.places, data }
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

/// Returns ROS 2's name of a type.
fn ros_type(kind: Type) -> &'static str {
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

/// Returns the fields in the format `ros2msg`. Fields `q[0]`, `q[1]` and so on become an array. A nested field such as
/// `esc[0].rpm` becomes `esc_0_rpm`.
fn schema(fields: &[MessageField]) -> String {
    let mut schema = String::new();
    let mut names = HashSet::new();
    let mut rest = fields;
    while let [first, ..] = rest {
        let length = array(rest);
        let name = match length {
            1 => &first.name,
            _ => first.name.trim_end_matches("[0]"),
        };
        let name = unlike(field_name(name), &mut names);
        let length_of = if length == 1 { String::new() } else { format!("[{length}]") };
        // Writing to a string cannot fail.
        let _ = writeln!(schema, "{}{length_of} {name}", ros_type(first.kind));
        rest = rest.get(length..).unwrap_or_default();
    }
    schema
}

/// Returns the length of the array at the beginning of the fields; 1 if the first field is no array.
fn array(fields: &[MessageField]) -> usize {
    let [first, ..] = fields else { return 1 };
    let Some(name) = first.name.strip_suffix("[0]") else { return 1 };
    let belongs =
        |(index, field): &(usize, &MessageField)| field.name == format!("{name}[{index}]") && field.kind == first.kind;
    fields.iter().enumerate().take_while(belongs).count().max(1)
}

/// Returns a valid ROS 2 field name: lower-case letters and digits, with single underscores between words.
fn field_name(name: &str) -> String {
    let words = name.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    let name = words.map(str::to_ascii_lowercase).collect::<Vec<_>>().join("_");
    if name.starts_with(|c: char| c.is_ascii_lowercase()) { name } else { format!("field_{name}") }
}

/// Returns a valid ROS 2 type name, such as `VehicleAttitude`.
fn type_name(name: &str) -> String {
    let words = name.split(|c: char| !c.is_ascii_alphanumeric());
    let capital = |word: &str| {
        let mut letters = word.chars();
        letters.next().map(|first| first.to_ascii_uppercase().to_string() + letters.as_str()).unwrap_or_default()
    };
    let name: String = words.map(capital).collect();
    if name.starts_with(|c: char| c.is_ascii_uppercase()) { name } else { format!("Topic{name}") }
}

/// Returns the name, or the name with a number appended if `names` has it already. Adds the result to `names`.
fn unlike(name: String, names: &mut HashSet<String>) -> String {
    let numbered = (2_u32..).map(|number| format!("{name}_{number}"));
    let free = std::iter::once(name.clone()).chain(numbered).find(|name| !names.contains(name)).unwrap_or(name);
    names.insert(free.clone());
    free
}

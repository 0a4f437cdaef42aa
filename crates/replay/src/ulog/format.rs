//! Formats of messages: the declared fields and their offsets.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::rc::Rc;

/// Deepest nesting of messages; PX4 nests two.
const DEPTH: usize = 8;
/// Largest total length of all field names in one format, and in all formats \[bytes\]. PX4's formats together have
/// names of some 200 KB, but a short nested declaration can name an unlimited number of fields.
const NAMES_OF_FORMAT: usize = 1 << 21;
const NAMES_OF_ALL: usize = 1 << 24;
/// Longest message \[bytes\].
const LONGEST: usize = u16::MAX as usize;
/// Prefix of fields that only align others. A padding field at the end of a message is not logged.
const PADDING: &str = "_padding";

/// Type of a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FieldType {
    Int8,
    UInt8,
    Int16,
    UInt16,
    Int32,
    UInt32,
    Int64,
    UInt64,
    Float,
    Double,
    Bool,
    Char,
}

impl FieldType {
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "int8_t" => FieldType::Int8,
            "uint8_t" => FieldType::UInt8,
            "int16_t" => FieldType::Int16,
            "uint16_t" => FieldType::UInt16,
            "int32_t" => FieldType::Int32,
            "uint32_t" => FieldType::UInt32,
            "int64_t" => FieldType::Int64,
            "uint64_t" => FieldType::UInt64,
            "float" => FieldType::Float,
            "double" => FieldType::Double,
            "bool" => FieldType::Bool,
            "char" => FieldType::Char,
            _ => return None,
        })
    }

    /// Returns the length of a value \[bytes\].
    pub(crate) fn size(self) -> usize {
        match self {
            FieldType::Int8 | FieldType::UInt8 | FieldType::Bool | FieldType::Char => 1,
            FieldType::Int16 | FieldType::UInt16 => 2,
            FieldType::Int32 | FieldType::UInt32 | FieldType::Float => 4,
            FieldType::Int64 | FieldType::UInt64 | FieldType::Double => 8,
        }
    }
}

/// A field of a message, or of a nested message.
#[derive(Debug)]
pub(crate) struct MessageField {
    /// Name, such as `q[0]` or `esc[1].rpm`.
    pub(crate) name: String,
    pub(crate) kind: FieldType,
    /// Offset of the field's first byte in the message.
    pub(crate) at: usize,
}

/// Layout of a message.
#[derive(Debug)]
pub(crate) struct UlogFormat {
    /// Name of the topic.
    pub(crate) name: String,
    /// Fields in the order of their offsets, without padding.
    pub(crate) fields: Vec<MessageField>,
    /// Length of a message \[bytes\].
    pub(crate) size: usize,
}

impl UlogFormat {
    /// Returns the offset of a field, if the field has that type.
    pub(crate) fn place(&self, name: &str, kind: FieldType) -> Option<usize> {
        self.fields.iter().find(|field| field.name == name && field.kind == kind).map(|field| field.at)
    }

    /// Returns the offset of the timestamp, if it is a 64-bit count of microseconds.
    pub(crate) fn timestamp(&self) -> Option<usize> {
        self.place("timestamp", FieldType::UInt64)
    }
}

/// A field as declared in the log.
#[derive(Debug, PartialEq, Eq)]
struct DeclaredField {
    kind: String,
    /// Length of the array, if the field is one.
    many: Option<usize>,
    name: String,
}

impl DeclaredField {
    /// Reads a declaration such as `float[4] q`.
    fn read(text: &str) -> Option<Self> {
        let (kind, name) = text.split_once(' ').filter(|(_, name)| !name.is_empty() && !name.contains(' '))?;
        let (kind, many) = match kind.split_once('[') {
            Some((kind, many)) => (kind, Some(many.strip_suffix(']')?.parse().ok()?)),
            None => (kind, None),
        };
        (!kind.is_empty()).then(|| DeclaredField { kind: kind.into(), many, name: name.into() })
    }
}

/// The formats of a log.
#[derive(Debug)]
pub(crate) struct UlogFormats {
    declared: HashMap<String, Vec<DeclaredField>>,
    /// Layouts that were computed before; none for an incomplete format.
    laid_out: HashMap<String, Option<Rc<UlogFormat>>>,
    /// Remaining length of all field names \[bytes\].
    left: usize,
}

impl Default for UlogFormats {
    fn default() -> Self {
        UlogFormats { declared: HashMap::new(), laid_out: HashMap::new(), left: NAMES_OF_ALL }
    }
}

impl UlogFormats {
    /// Takes a declaration, `topic:type name;type[n] name;`. Returns none if it is damaged or contradicts an earlier
    /// one.
    pub(crate) fn declare(&mut self, text: &[u8]) -> Option<()> {
        let (name, fields) = std::str::from_utf8(text).ok()?.split_once(':').filter(|(name, _)| !name.is_empty())?;
        let fields = fields.split(';').filter(|field| !field.is_empty());
        let fields = fields.map(DeclaredField::read).collect::<Option<Vec<_>>>()?;
        match self.declared.entry(name.to_owned()) {
            Entry::Occupied(known) => (*known.get() == fields).then_some(()),
            Entry::Vacant(free) => {
                free.insert(fields);
                Some(())
            }
        }
    }

    /// Returns the format of a topic; none if the topic or a nested message is not declared, or if the format is too
    /// large or too deep.
    pub(crate) fn of(&mut self, name: &str) -> Option<Rc<UlogFormat>> {
        if let Some(known) = self.laid_out.get(name) {
            return known.clone();
        }
        let most = self.left.min(NAMES_OF_FORMAT);
        let mut layout = FormatLayout { declared: &self.declared, fields: Vec::new(), at: 0, left: most };
        let is_whole = layout.add(name, "", 0).is_some();
        let FormatLayout { fields, at, left, .. } = layout;
        self.left -= most - left;
        let format = is_whole.then(|| Rc::new(UlogFormat { name: name.into(), fields, size: at }));
        self.laid_out.insert(name.into(), format.clone());
        format
    }
}

/// A message while its fields are laid out.
struct FormatLayout<'a> {
    declared: &'a HashMap<String, Vec<DeclaredField>>,
    fields: Vec<MessageField>,
    at: usize,
    left: usize,
}

impl FormatLayout<'_> {
    /// Adds the fields of the message `name`, whose names get `prefix`.
    fn add(&mut self, name: &str, prefix: &str, depth: usize) -> Option<()> {
        let declared = self.declared;
        let fields = declared.get(name).filter(|_| depth < DEPTH)?;
        for (index, DeclaredField { kind, many, name }) in fields.iter().enumerate() {
            let is_padding = name.starts_with(PADDING);
            if is_padding && depth == 0 && index + 1 == fields.len() {
                break;
            }
            for element in 0..many.unwrap_or(1) {
                let name = match many {
                    Some(_) => format!("{prefix}{name}[{element}]"),
                    None => format!("{prefix}{name}"),
                };
                self.left = self.left.checked_sub(1 + name.len())?;
                match FieldType::named(kind) {
                    Some(kind) => {
                        let at = self.at;
                        self.at = Some(at + kind.size()).filter(|end| *end <= LONGEST)?;
                        if !is_padding {
                            self.fields.push(MessageField { name, kind, at });
                        }
                    }
                    None => {
                        let before = self.fields.len();
                        self.add(kind, &format!("{name}."), depth + 1)?;
                        if is_padding {
                            self.fields.truncate(before);
                        }
                    }
                }
            }
        }
        Some(())
    }
}

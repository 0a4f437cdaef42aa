//! Decodes the records of a log.

use super::format::{UlogFormat, UlogFormats};
use std::borrow::Cow;
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::fmt;
use std::rc::Rc;

/// A topic that is logged.
#[derive(Debug)]
pub(crate) struct UlogSubscription {
    pub(crate) format: Rc<UlogFormat>,
    /// Number among several instances of the same topic, counted from 0.
    pub(crate) instance: u8,
}

/// Value of a parameter.
#[derive(Clone, Copy, Debug)]
pub(crate) enum UlogValue {
    Int32(i32),
    Float(f32),
}

impl UlogValue {
    /// Returns the value as a number.
    pub(crate) fn number(self) -> f64 {
        match self {
            UlogValue::Int32(value) => value.into(),
            UlogValue::Float(value) => value.into(),
        }
    }
}

impl fmt::Display for UlogValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            UlogValue::Int32(value) => value.fmt(f),
            UlogValue::Float(value) => value.fmt(f),
        }
    }
}

/// Content of a record.
pub(crate) enum UlogEntry<'a> {
    /// A message of a topic.
    Message { id: u16, topic: &'a UlogSubscription, data: &'a [u8] },
    /// A parameter; `is_initial` is true before the data section.
    Parameter { name: &'a str, value: UlogValue, is_initial: bool },
    /// Information on the vehicle, such as its hardware.
    Information { kind: &'a str, name: &'a str, value: &'a [u8] },
    /// A text message with its ULog level.
    Text { time_us: u64, level: u8, text: Cow<'a, str> },
    /// A dropout of this length \[ms\].
    Dropout(u16),
    /// A record that readers do not need.
    Other,
}

/// Decodes records one after the other. A damaged record does not affect the others.
#[derive(Debug, Default)]
pub(crate) struct LogReader {
    formats: UlogFormats,
    topics: HashMap<u16, UlogSubscription>,
    /// True after the definitions section.
    is_in_data: bool,
}

impl LogReader {
    /// Returns the content of a record; none if the record is damaged.
    pub(crate) fn entry<'a>(&'a mut self, record: &'a [u8]) -> Option<UlogEntry<'a>> {
        let &[_, _, kind, ref content @ ..] = record else { return None };
        self.is_in_data |= b"ADLCORS".contains(&kind);
        match kind {
            b'F' => self.formats.declare(content).map(|()| UlogEntry::Other),
            b'A' => self.add(content).map(|()| UlogEntry::Other),
            b'D' => {
                let (id, data) = content.split_first_chunk()?;
                let id = u16::from_le_bytes(*id);
                let topic = self.topics.get(&id).filter(|topic| topic.format.size == data.len())?;
                Some(UlogEntry::Message { id, topic, data })
            }
            b'P' => {
                let (kind, name, value) = keyed(content)?;
                let value = *value.first_chunk().filter(|_| value.len() == 4 && !name.contains(' '))?;
                let value = match kind {
                    "int32_t" => UlogValue::Int32(i32::from_le_bytes(value)),
                    "float" => UlogValue::Float(f32::from_le_bytes(value)),
                    _ => return None,
                };
                Some(UlogEntry::Parameter { name, value, is_initial: !self.is_in_data })
            }
            b'I' => keyed(content).map(|(kind, name, value)| UlogEntry::Information { kind, name, value }),
            b'L' => {
                let (level, rest) = content.split_first()?;
                text(*level, rest)
            }
            b'C' => {
                let (level, rest) = content.split_first()?;
                text(*level, rest.get(2..)?)
            }
            b'O' => content.first_chunk().map(|lost_ms| UlogEntry::Dropout(u16::from_le_bytes(*lost_ms))),
            _ => Some(UlogEntry::Other),
        }
    }

    /// Takes a subscription to a topic: instance, id, name.
    fn add(&mut self, content: &[u8]) -> Option<()> {
        let &[instance, low, high, ref name @ ..] = content else { return None };
        let format = self.formats.of(std::str::from_utf8(name).ok()?)?;
        match self.topics.entry(u16::from_le_bytes([low, high])) {
            Entry::Occupied(known) => {
                let UlogSubscription { format: held, instance: own } = known.get();
                (held.name == format.name && *own == instance).then_some(())
            }
            Entry::Vacant(free) => {
                free.insert(UlogSubscription { format, instance });
                Some(())
            }
        }
    }
}

/// Returns type, name and value of a keyed record: the key's length, the key `type name`, the value.
fn keyed(content: &[u8]) -> Option<(&str, &str, &[u8])> {
    let (length, rest) = content.split_first()?;
    let (key, value) = rest.split_at_checked(usize::from(*length))?;
    let key = std::str::from_utf8(key).ok()?;
    let (kind, name) = key.split_once(' ').unwrap_or(("", key));
    Some((kind, name, value))
}

fn text(level: u8, rest: &[u8]) -> Option<UlogEntry<'_>> {
    let (time, text) = rest.split_first_chunk()?;
    // A text with invalid UTF-8 is better than none.
    Some(UlogEntry::Text { time_us: u64::from_le_bytes(*time), level, text: String::from_utf8_lossy(text) })
}

//! Writes the log's beginning: information, formats, parameters, default values, subscriptions.

use crate::ulog::layout::Wire;
use crate::ulog::record::Content;
use crate::ulog::ring::RingView;
use crate::ulog::topics::{ESC_REPORT, EscReport, TOPICS};
use afbc_onboard::parameters::{Kind, Parameter, ParameterTable};
use heapless::String;

/// Longest name of vehicle, law or hardware \[bytes\]. A longer name is cut off.
const WORD_MAX: usize = 32;
/// First bytes of every log, with the version of the format.
const MAGIC: [u8; 8] = *b"ULog\x01\x12\x35\x01";
/// Content of the flag bits message: no flags, no appended data.
const FLAGS: [u8; 40] = [0; 40];
/// Name and version of this software.
const SYSTEM: &str = "AFBC";
const VERSION: &str = env!("CARGO_PKG_VERSION");
/// Lowest byte of the version's number: a release.
const RELEASE: u32 = 255;
/// PX4's number of the message layouts of version 1.15; readers query it.
const DATA_FORMAT: u32 = 2;
/// Type of default value: the system's default.
const SYSTEM_DEFAULT: u8 = 1;

/// Describes the vehicle for the log's beginning.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LogStart<'a> {
    /// Name of the vehicle.
    pub vehicle: &'a str,
    /// Name of the law.
    pub law: &'a str,
    /// Name of the hardware.
    pub hardware: &'a str,
    /// Unique identifier of this board, if it has one.
    pub unique: Option<&'a str>,
    /// Offset of local time from UTC \[s\].
    pub utc_offset_s: i32,
}

/// Writes the log's beginning, piece by piece as there is room.
#[derive(Clone, Debug)]
pub(crate) struct Definitions {
    vehicle: String<WORD_MAX>,
    law: String<WORD_MAX>,
    hardware: String<WORD_MAX>,
    unique: Option<String<WORD_MAX>>,
    utc_offset_s: i32,
    part: Part,
    /// Number of the next entry of this part.
    next: u16,
}

/// A part of the log's beginning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    Header,
    Information,
    Formats,
    Parameters,
    Defaults,
    Subscriptions,
    Done,
}

/// Returns the text, shortened to the whole letters that fit.
fn word(text: &str) -> String<WORD_MAX> {
    let mut word = String::new();
    // Stops at the first letter that does not fit.
    let _ = text.chars().try_for_each(|letter| word.push(letter));
    word
}

impl Definitions {
    pub(crate) fn new(start: &LogStart<'_>) -> Self {
        Definitions {
            vehicle: word(start.vehicle),
            law: word(start.law),
            hardware: word(start.hardware),
            unique: start.unique.map(word),
            utc_offset_s: start.utc_offset_s,
            part: Part::Header,
            next: 0,
        }
    }

    /// Returns true once the beginning is complete.
    pub(crate) fn is_done(&self) -> bool {
        self.part == Part::Done
    }

    /// Writes at most `pace` entries, as far as there is room. An entry that needs no record counts as well.
    #[inline(never)]
    pub(crate) fn write(&mut self, now_us: u64, table: &ParameterTable, pace: u16, ring: &mut RingView<'_>) {
        let mut left = pace;
        while self.part != Part::Done && left > 0 {
            match self.one(now_us, table, ring) {
                Some(true) => (self.next, left) = (self.next + 1, left - 1),
                Some(false) => return,
                None => (self.part, self.next) = (self.part.after(), 0),
            }
        }
    }

    /// Writes the part's next entry. Returns none after the last entry, and false if there is no room.
    fn one(&self, now_us: u64, table: &ParameterTable, ring: &mut RingView<'_>) -> Option<bool> {
        let index = usize::from(self.next);
        Some(match self.part {
            Part::Header => match index {
                // Header and flags are written in one piece, because readers take a log without flags for an old log.
                0 => ring.bytes(&mut |content| {
                    content.put(&MAGIC);
                    content.put(&now_us.to_le_bytes());
                    content.put(&[FLAGS.len() as u8, 0, b'B']);
                    content.put(&FLAGS);
                }),
                _ => return None,
            },
            Part::Information => self.information(index, ring)?,
            Part::Formats => {
                // `esc_report` comes first, because a topic contains it.
                let (name, fields) = match index.checked_sub(1) {
                    None => (EscReport::KIND, ESC_REPORT),
                    Some(index) => TOPICS.get(index).map(|topic| (topic.name, topic.fields))?,
                };
                ring.record(b'F', &mut |content| {
                    content.put(name.as_bytes());
                    content.put(b":");
                    fields.iter().for_each(|field| field.format(content));
                })
            }
            Part::Parameters => parameter(&table.at(self.next)?, ring),
            Part::Defaults => {
                let parameter = table.at(self.next)?;
                match table.default_at(self.next) {
                    Some(default) if default.value.to_bits() != parameter.value.to_bits() => {
                        ring.record(b'Q', &mut |content| {
                            content.put(&[SYSTEM_DEFAULT]);
                            put_parameter(&default, content);
                        })
                    }
                    _ => true,
                }
            }
            Part::Subscriptions => {
                let topic = TOPICS.get(index)?;
                ring.record(b'A', &mut |content| {
                    content.put(&[0]);
                    content.put(&self.next.to_le_bytes());
                    content.put(topic.name.as_bytes());
                })
            }
            Part::Done => return None,
        })
    }

    /// Writes an information message. Returns none after the last message.
    fn information(&self, index: usize, ring: &mut RingView<'_>) -> Option<bool> {
        let text = |ring: &mut RingView<'_>, name: &str, text: &str| match text {
            "" => true,
            text => ring.record(b'I', &mut |content| {
                keyed(content, |key| {
                    key.put(b"char[");
                    key.number(text.len());
                    key.put(b"] ");
                    key.put(name.as_bytes());
                });
                content.put(text.as_bytes());
            }),
        };
        let number = |ring: &mut RingView<'_>, name: &str, bytes: [u8; 4]| {
            ring.record(b'I', &mut |content| {
                keyed(content, |key| key.put(name.as_bytes()));
                content.put(&bytes);
            })
        };
        Some(match index {
            0 => text(ring, "sys_name", SYSTEM),
            1 => text(ring, "ver_hw", &self.hardware),
            2 => text(ring, "ver_sw", VERSION),
            3 => number(ring, "uint32_t ver_sw_release", release(VERSION).to_le_bytes()),
            // Tells readers which version of PX4's topic layouts the log has.
            4 => number(ring, "uint32_t ver_data_format", DATA_FORMAT.to_le_bytes()),
            5 => text(ring, "sys_uuid", self.unique.as_deref().unwrap_or_default()),
            6 => number(ring, "int32_t time_ref_utc", self.utc_offset_s.to_le_bytes()),
            7 => text(ring, "afbc_vehicle", &self.vehicle),
            8 => text(ring, "afbc_law", &self.law),
            _ => return None,
        })
    }
}

impl Part {
    fn after(self) -> Part {
        match self {
            Part::Header => Part::Information,
            Part::Information => Part::Formats,
            Part::Formats => Part::Parameters,
            Part::Parameters => Part::Defaults,
            Part::Defaults => Part::Subscriptions,
            Part::Subscriptions | Part::Done => Part::Done,
        }
    }
}

/// Returns the number of a version like `1.2.3`: a byte for each part, and a byte for the type of release.
fn release(version: &str) -> u32 {
    let parts = version.split('.').map(|part| part.parse::<u8>().unwrap_or_default());
    parts.take(3).zip([24, 16, 8]).map(|(part, shift)| u32::from(part) << shift).sum::<u32>() | RELEASE
}

/// Writes a key after its length.
fn keyed(content: &mut Content<'_>, key: impl Fn(&mut Content<'_>)) {
    // `key` runs twice, the first time to count: the length comes first, and there is no buffer for the key.
    let mut length = 0_u8;
    key(&mut Content::new(&mut |_| length = length.saturating_add(1)));
    content.put(&[length]);
    key(content);
}

/// Writes a parameter. Returns false if there is no room.
pub(crate) fn parameter(parameter: &Parameter, ring: &mut RingView<'_>) -> bool {
    ring.record(b'P', &mut |content| put_parameter(parameter, content))
}

fn put_parameter(parameter: &Parameter, content: &mut Content<'_>) {
    let kind: &[u8] = match parameter.kind {
        Kind::Real32 => b"float ",
        Kind::Int32 => b"int32_t ",
    };
    keyed(content, |key| {
        key.put(kind);
        key.put(parameter.name.as_str().as_bytes());
    });
    content.put(&parameter.kind.encode(parameter.value));
}

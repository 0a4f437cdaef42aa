//! Parameter files as ground stations write them: QGroundControl's `.params` and MAVProxy's `.parm`.
//!
//! Each line holds fields. QGroundControl's have five: system, component, name, value, type. MAVProxy's have two: name
//! and value. `#` begins a comment. Both formats are recognised by the number of fields, not by the file name.

use crate::read::{FileError, SourceFile};
use core::fmt::Write;

/// One parameter of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterEntry {
    /// Name.
    pub name: String,
    /// Value.
    pub value: f32,
    /// Byte offset of its line in the text.
    pub at: usize,
}

/// Format of a parameter file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParameterFormat {
    /// QGroundControl's format.
    Qgc,
    /// MAVProxy's format.
    Mavproxy,
}

/// Reads the parameters in `text`, the contents of `file`.
///
/// # Errors
/// One line about the first wrong line of the file.
pub fn read(file: &str, text: &str) -> Result<Vec<ParameterEntry>, FileError> {
    let (mut entries, mut at) = (Vec::<ParameterEntry>::new(), 0);
    for line in text.split_inclusive('\n') {
        let start = at;
        at += line.len();
        let line = line.split('#').next().unwrap_or_default();
        let fields: Vec<&str> = line.split([' ', '\t', ',', '\r', '\n']).filter(|field| !field.is_empty()).collect();
        let fault = |key: &str, problem: String| Err(FileError::at(SourceFile { file, text }, start, key, problem));
        let (name, value) = match *fields {
            [] => continue,
            [name, value] | [_, _, name, value, _] => (name, value),
            _ => {
                let problem = "neither `name value` nor `system component name value type`";
                return fault("", format!("{} fields, {problem}", fields.len()));
            }
        };
        let Some(number) = value.parse().ok().filter(|number: &f32| number.is_finite()) else {
            return fault(name, format!("\"{value}\" is no number"));
        };
        if entries.iter().any(|entry| entry.name == name) {
            return fault(name, "the parameter has two values; delete one of them".into());
        }
        entries.push(ParameterEntry { name: name.into(), value: number, at: start });
    }
    Ok(entries)
}

/// Returns the text of a parameter file. Entries are name, value, MAV_PARAM_TYPE; reading the text returns exactly the
/// same values.
pub fn written<N: core::fmt::Display>(
    format: ParameterFormat,
    vehicle: &str,
    entries: impl IntoIterator<Item = (N, f32, u8)>,
) -> String {
    let mut text = match format {
        ParameterFormat::Qgc => format!(
            "# Onboard parameters for Vehicle 1\n#\n# {vehicle}\n#\n# Vehicle-Id Component-Id Name Value Type\n"
        ),
        ParameterFormat::Mavproxy => format!("# {vehicle}\n"),
    };
    for (name, value, kind) in entries {
        // Writing to a string cannot fail.
        let _ = match format {
            ParameterFormat::Qgc => writeln!(text, "1\t1\t{name}\t{value}\t{kind}"),
            ParameterFormat::Mavproxy => writeln!(text, "{name:<16} {value}"),
        };
    }
    text
}

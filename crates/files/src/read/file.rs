//! Reading of TOML files: size, syntax, name and description.

use super::error::{FileError, SourceFile};
use super::inheritance;
use super::mistakes::read_all;
use super::table::Table;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;
use toml::de::DeTable;

/// Largest length of a name \[bytes\].
const NAME_LENGTH: usize = 64;
/// Largest file accepted \[bytes\].
const FILE_SIZE: u64 = 1 << 20;

/// Returns the text of a file of this `kind`; error messages point to the built-in files of that kind.
///
/// # Errors
/// If it cannot be read, is too large, or is not text.
pub fn text(path: &Path, kind: &str) -> Result<String, FileError> {
    let read = || {
        let mut text = String::new();
        // Reads one byte more than the limit: enough to detect a file that is too large, whatever its size.
        let read = File::open(path)?.take(FILE_SIZE + 1).read_to_string(&mut text)?;
        if read as u64 > FILE_SIZE { Err(io::ErrorKind::FileTooLarge.into()) } else { Ok(text) }
    };
    read().map_err(|error: io::Error| {
        let problem = match error.kind() {
            io::ErrorKind::NotFound => format!("no such file; `sitl {kind}s` lists the built-in ones"),
            io::ErrorKind::IsADirectory => format!("this is a folder; name a {kind} file in it"),
            io::ErrorKind::InvalidData => "the file is not UTF-8 text; save it as UTF-8".into(),
            io::ErrorKind::FileTooLarge => {
                format!("the file is larger than 1 MiB, too large for a {kind}; name another file")
            }
            _ => format!("the file cannot be read ({error}); check its permissions"),
        };
        FileError::whole(&path.display().to_string(), problem)
    })
}

/// A valid example of a kind of file.
#[derive(Clone, Copy, Debug)]
pub struct Example {
    /// `sitl` command that prints the example.
    pub command: &'static str,
    /// Text of the example. Reading on after a mistake takes missing tables from it.
    pub text: &'static str,
}

/// Parses the `text` of a TOML file with `read`.
///
/// # Errors
/// If the text is not TOML, or if `read` finds mistakes: the error holds all of them.
pub fn document<T>(
    file: &str,
    text: &str,
    sample: Example,
    read: impl Fn(Table<'_>) -> Result<T, FileError>,
) -> Result<T, FileError> {
    let source = SourceFile { file, text };
    read_all(source, parsed(source, sample)?, sample.text, read)
}

/// Parses a document like [`document`], with inheritance: a table in the list `list` may say `like = "NAME"`. It then
/// takes the keys that it lacks from the earlier table of that name, except the keys `own`.
///
/// # Errors
/// Like [`document`]. A `like` that names no earlier table is left for `read` to refuse.
pub fn document_with_inheritance<T>(
    file: &str,
    text: &str,
    sample: Example,
    (list, own): (&str, &[&str]),
    read: impl Fn(Table<'_>) -> Result<T, FileError>,
) -> Result<T, FileError> {
    let source = SourceFile { file, text };
    let mut document = parsed(source, sample)?;
    inheritance::inherit(&mut document, list, own);
    read_all(source, document, sample.text, read)
}

/// Parses the text.
///
/// # Errors
/// Every TOML syntax error.
fn parsed<'t>(source: SourceFile<'t>, sample: Example) -> Result<DeTable<'t>, FileError> {
    let (document, errors) = DeTable::parse_recoverable(source.text);
    // In a table that occurs twice, every key is a duplicate as well: only the table is reported.
    let (mut twice, mut told) = (Vec::new(), Vec::new());
    for error in &errors {
        let at = error.span().unwrap_or_default().start;
        let head = head(source.text, at);
        match error.message().starts_with("duplicate key") {
            true if twice.contains(&head) => continue,
            true if head.1 == source.line(at) => twice.push(head),
            _ => {}
        }
        told.push(error);
    }
    let mut errors: Vec<_> = told.into_iter().map(|error| syntax(source, error, sample.command)).collect();
    // Keeps the first error of each line; later errors on the line follow from it.
    errors.dedup_by_key(|error| error.line());
    if errors.is_empty() { Ok(document.into_inner()) } else { Err(FileError::all(errors)) }
}

/// Returns name and description. The name defaults to `name`.
///
/// # Errors
/// If the name cannot be part of a file name, or the description has several lines.
pub fn title(root: &mut Table<'_>, name: &str) -> Result<[String; 2], FileError> {
    let name = root.text("name")?.unwrap_or(name).to_owned();
    if !is_file_name(&name) {
        let cure = "a name must be 1 to 64 letters, digits, '-' or '_', since file names are made from it";
        return Err(root.fault_at("name", format!("\"{name}\" cannot be a name; {cure}")));
    }
    let description = root.text("description")?.unwrap_or_default().to_owned();
    if description.chars().any(char::is_control) {
        return Err(
            root.fault_at("description", "the text has line breaks or control characters; make it one plain line")
        );
    }
    Ok([name, description])
}

/// Returns the header of the table around byte `at`, and its line; empty before the first header.
fn head(text: &str, at: usize) -> (&str, usize) {
    let line = text.bytes().take(at).filter(|byte| *byte == b'\n').count();
    let lines = text.lines().enumerate().take(line + 1);
    let heads = lines.filter(|(_, text)| text.trim_start().starts_with('['));
    heads.last().map_or(("", 0), |(number, text)| (text, number + 1))
}

/// Returns the error for a TOML syntax error.
fn syntax(source: SourceFile<'_>, error: &toml::de::Error, sample: &str) -> FileError {
    let span = error.span().unwrap_or_default();
    let near = source.text.get(span.clone()).and_then(|text| text.lines().next()).unwrap_or_default();
    let near: String = near.chars().take(40).collect();
    let near = if near.is_empty() { near } else { format!(" near `{near}`") };
    let problem = format!("{}{near}; `sitl {sample}` prints a file to compare with", error.message());
    FileError::at(source, span.start, "syntax", problem)
}

/// True if `name` is valid in file names on every system.
fn is_file_name(name: &str) -> bool {
    let safe = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'-' || byte == b'_';
    (1..=NAME_LENGTH).contains(&name.len()) && name.bytes().all(safe)
}

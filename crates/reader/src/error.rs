//! Errors in TOML files.

use std::fmt;

/// An error as one line: `FILE:LINE: KEY: problem; remedy`. An unreadable file has no line and no key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileError {
    file: String,
    line: Option<usize>,
    key: String,
    problem: String,
}

impl FileError {
    /// Creates an error about the file as a whole.
    pub fn whole(file: &str, problem: impl Into<String>) -> Self {
        FileError { file: file.into(), line: None, key: String::new(), problem: problem.into() }
    }

    /// Creates an error at byte `at` of `text`; `key` is empty if it concerns no key.
    pub fn at(source: Source<'_>, at: usize, key: impl Into<String>, problem: impl Into<String>) -> Self {
        let line = 1 + source.text.bytes().take(at).filter(|&byte| byte == b'\n').count();
        FileError { file: source.file.into(), line: Some(line), key: key.into(), problem: problem.into() }
    }
}

/// A file's name, as given by the user, and its text.
#[derive(Clone, Copy, Debug)]
pub struct Source<'a> {
    /// Name as given.
    pub file: &'a str,
    /// The whole text.
    pub text: &'a str,
}

impl fmt::Display for FileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut line = self.file.clone();
        if let Some(number) = self.line {
            line += &format!(":{number}");
        }
        if !self.key.is_empty() {
            line += &format!(": {}", self.key);
        }
        line += &format!(": {}", self.problem);
        // Quoted keys, strings and file names may contain line breaks; the error must be one line.
        line.chars()
            .try_for_each(|c| if c.is_control() { write!(f, "{}", c.escape_default()) } else { write!(f, "{c}") })
    }
}

impl std::error::Error for FileError {}

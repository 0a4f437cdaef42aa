//! What is wrong with a scenario file, in one line.

use std::fmt;

/// One line for people: `FILE:LINE: KEY: what is wrong; the cure`. A file that cannot be read has no line and no key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileError {
    file: String,
    line: Option<usize>,
    key: String,
    problem: String,
}

impl FileError {
    /// The file as a whole is of no use.
    pub fn whole(file: &str, problem: impl Into<String>) -> Self {
        FileError { file: file.into(), line: None, key: String::new(), problem: problem.into() }
    }

    /// Something at byte `at` of `text`; `key` is empty if it is not about a key.
    pub fn at(source: Source<'_>, at: usize, key: impl Into<String>, problem: impl Into<String>) -> Self {
        let line = 1 + source.text.bytes().take(at).filter(|&byte| byte == b'\n').count();
        FileError { file: source.file.into(), line: Some(line), key: key.into(), problem: problem.into() }
    }
}

/// A file's name, as the user gave it, and its text.
#[derive(Clone, Copy, Debug)]
pub struct Source<'a> {
    /// As it was asked for.
    pub file: &'a str,
    /// All of it.
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
        // Quoted keys, strings and file names may hold line breaks; this is one line whatever they hold.
        line.chars()
            .try_for_each(|c| if c.is_control() { write!(f, "{}", c.escape_default()) } else { write!(f, "{c}") })
    }
}

impl std::error::Error for FileError {}

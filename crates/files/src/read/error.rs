//! Errors in TOML files.

use std::fmt;

/// Mistakes in a file, each as one line: `FILE:LINE: KEY: problem; remedy`. An unreadable file has no line and no key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileError {
    first: Mistake,
    others: Vec<Mistake>,
}

/// One mistake.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Mistake {
    file: String,
    line: Option<usize>,
    key: String,
    problem: String,
    /// Place in the file being read; none if the mistake concerns the file as a whole.
    place: Option<Box<FileLocation>>,
}

/// Position of a mistake in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct FileLocation {
    pub(crate) file: String,
    /// Dotted key.
    pub(crate) key: String,
    /// Byte offset in the text; `line` is the line with that byte.
    pub(crate) at: usize,
    pub(crate) line: usize,
    /// Byte offset at which the key's table begins.
    pub(crate) table: usize,
    pub(crate) fault: MistakeKind,
}

/// Kind of mistake.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum MistakeKind {
    /// The value is wrong.
    Value,
    /// The value is none of the options. Holds the most similar option, or all of them.
    Choice(Vec<&'static str>),
    /// The key is missing.
    Missing,
    /// The key is unknown. Holds the correct key if this looks like a misspelling.
    Unknown(Option<&'static str>),
    /// The value conflicts with the values of these dotted keys; if the list is empty, with the others in its table.
    Clash(&'static [&'static str]),
}

impl FileError {
    /// Creates an error about the file as a whole.
    pub fn whole(file: &str, problem: impl Into<String>) -> Self {
        let (file, problem) = (file.into(), problem.into());
        FileError::of(Mistake { file, line: None, key: String::new(), problem, place: None })
    }

    /// Creates an error at byte `at` of `text`; `key` is empty if it concerns no key.
    pub fn at(source: SourceFile<'_>, at: usize, key: impl Into<String>, problem: impl Into<String>) -> Self {
        let line = source.line(at);
        let (file, key): (String, String) = (source.file.into(), key.into());
        let place =
            FileLocation { file: file.clone(), key: key.clone(), at, line, table: 0, fault: MistakeKind::Value };
        let place = Some(Box::new(place)).filter(|place| !place.key.is_empty());
        FileError::of(Mistake { file, line: Some(line), key, problem: problem.into(), place })
    }

    const fn of(first: Mistake) -> Self {
        FileError { first, others: Vec::new() }
    }

    /// Joins all mistakes of a file into one error, in the order of the lines. `errors` must not be empty.
    pub(crate) fn all(errors: Vec<FileError>) -> Self {
        let mistakes = errors.into_iter().flat_map(|FileError { first, others }| [first].into_iter().chain(others));
        let mut mistakes: Vec<Mistake> = mistakes.collect();
        mistakes.sort_by_key(|mistake| mistake.place.as_ref().map(|place| place.line));
        let mut mistakes = mistakes.into_iter();
        let first = mistakes.next().unwrap_or_else(|| FileError::whole("file", "cannot be read").first);
        FileError { first, others: mistakes.collect() }
    }

    /// Joins both errors into one, without repeating a mistake.
    #[must_use]
    pub fn and(mut self, other: FileError) -> Self {
        let more = [other.first].into_iter().chain(other.others);
        let is_new = |mistake: &Mistake| *mistake != self.first && !self.others.contains(mistake);
        let more: Vec<_> = more.filter(is_new).collect();
        self.others.extend(more);
        self
    }

    /// Returns the line of the first mistake.
    pub(crate) const fn line(&self) -> Option<usize> {
        self.first.line
    }

    /// Returns the position of the first mistake.
    pub(crate) fn place(&self) -> Option<&FileLocation> {
        self.first.place.as_deref()
    }

    /// Sets the kind of the first mistake.
    pub(crate) fn because(mut self, fault: MistakeKind) -> Self {
        self.first.place.iter_mut().for_each(|place| place.fault = fault.clone());
        self
    }

    /// Changes the positions of the mistakes; the message stays the same.
    pub(crate) fn placed(mut self, change: impl Fn(&mut Option<Box<FileLocation>>)) -> Self {
        change(&mut self.first.place);
        self.others.iter_mut().for_each(|other| change(&mut other.place));
        self
    }
}

/// A file's name and text.
#[derive(Clone, Copy, Debug)]
pub struct SourceFile<'a> {
    /// Name as the user gave it.
    pub file: &'a str,
    /// The whole text.
    pub text: &'a str,
}

impl SourceFile<'_> {
    /// Returns the line of the byte `at`.
    pub(crate) fn line(&self, at: usize) -> usize {
        1 + self.text.bytes().take(at).filter(|&byte| byte == b'\n').count()
    }
}

impl fmt::Display for FileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.first.fmt(f)?;
        self.others.iter().try_for_each(|other| write!(f, "\n{other}"))
    }
}

impl fmt::Display for Mistake {
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

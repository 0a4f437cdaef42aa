//! Files that come with the program: each is a template too.

use super::error::FileError;
use super::words::nearest;

/// A file that comes with the program, and what it describes.
#[derive(Clone, Copy, Debug)]
pub struct BuiltIn<T: 'static> {
    /// What the command line knows it by.
    pub name: &'static str,
    /// The file.
    pub text: &'static str,
    /// Reads it: what errors call it, its text, its name.
    parse: fn(&str, &str, &str) -> Result<T, FileError>,
}

impl<T> BuiltIn<T> {
    /// The file `text` called `name`, which `parse` reads.
    pub const fn new(
        name: &'static str,
        text: &'static str,
        parse: fn(&str, &str, &str) -> Result<T, FileError>,
    ) -> Self {
        BuiltIn { name, text, parse }
    }

    /// What the file describes.
    ///
    /// # Errors
    /// None in fact: a test reads every one.
    pub fn read(&self) -> Result<T, FileError> {
        (self.parse)(&format!("built-in {}", self.name), self.text, self.name)
    }

    /// The one of `all` called `name`.
    pub fn named(all: &'static [Self], name: &str) -> Option<&'static Self> {
        all.iter().find(|built_in| built_in.name == name)
    }

    /// The one of `all` that somebody who wrote `name` may have meant.
    pub fn similar(all: &'static [Self], name: &str) -> Option<&'static Self> {
        nearest(name, all.iter().map(|built_in| built_in.name)).and_then(|known| Self::named(all, known))
    }
}

//! Files that come with the program, which are also templates.

use super::error::FileError;
use super::words::nearest;

/// A built-in file.
#[derive(Clone, Copy, Debug)]
pub struct BuiltIn<T: 'static> {
    /// Name on the command line.
    pub name: &'static str,
    /// Text of the file.
    pub text: &'static str,
    /// Parses it, given the file's name for errors, its text and its name.
    parse: fn(&str, &str, &str) -> Result<T, FileError>,
}

impl<T> BuiltIn<T> {
    /// Creates the file `text` called `name`, which `parse` reads.
    pub const fn new(
        name: &'static str,
        text: &'static str,
        parse: fn(&str, &str, &str) -> Result<T, FileError>,
    ) -> Self {
        BuiltIn { name, text, parse }
    }

    /// Parses the file.
    ///
    /// # Errors
    /// Does not occur: a test reads every file.
    pub fn read(&self) -> Result<T, FileError> {
        (self.parse)(&format!("built-in {}", self.name), self.text, self.name)
    }

    /// Returns the one of `all` called `name`.
    pub fn named(all: &'static [Self], name: &str) -> Option<&'static Self> {
        all.iter().find(|built_in| built_in.name == name)
    }

    /// Returns the one of `all` whose name is similar to `name`.
    pub fn similar(all: &'static [Self], name: &str) -> Option<&'static Self> {
        nearest(name, all.iter().map(|built_in| built_in.name)).and_then(|known| Self::named(all, known))
    }
}

//! Built-in files, which also serve as templates.

use super::error::FileError;
use super::words::nearest;

/// A built-in file.
#[derive(Clone, Copy, Debug)]
pub struct BuiltIn<T: 'static> {
    /// Name on the command line.
    pub name: &'static str,
    /// Text of the file.
    pub text: &'static str,
    /// Function that parses the file, given its name for error messages, its text and its name.
    parse: fn(&str, &str, &str) -> Result<T, FileError>,
}

impl<T> BuiltIn<T> {
    /// Creates the built-in file `name` with the content `text`, parsed by `parse`.
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
    /// Never fails in practice: a test reads every built-in file.
    pub fn read(&self) -> Result<T, FileError> {
        (self.parse)(&format!("built-in {}", self.name), self.text, self.name)
    }

    /// Returns the built-in file called `name`.
    pub fn named(all: &'static [Self], name: &str) -> Option<&'static Self> {
        all.iter().find(|built_in| built_in.name == name)
    }

    /// Returns the built-in file whose name is most similar to `name`, if any is similar.
    pub fn similar(all: &'static [Self], name: &str) -> Option<&'static Self> {
        nearest(name, all.iter().map(|built_in| built_in.name)).and_then(|known| Self::named(all, known))
    }
}

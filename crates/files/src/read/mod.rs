//! Reading of TOML files and parameter files, with one-line error messages.

mod built_in;
mod delimited;
mod error;
mod file;
mod inheritance;
mod mistakes;
pub mod params;
mod table;
pub mod words;

pub use built_in::BuiltIn;
pub use delimited::DelimitedFormat;
pub use error::{FileError, SourceFile};
pub use file::{Example, document, document_with_inheritance, text, title};
pub use inheritance::LIKE;
pub use table::Table;

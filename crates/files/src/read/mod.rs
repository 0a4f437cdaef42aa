//! Reading of TOML files and parameter files, with one-line error messages.

mod built_in;
mod error;
mod file;
mod heirs;
mod mistakes;
pub mod params;
mod separated;
mod table;
pub mod words;

pub use built_in::BuiltIn;
pub use error::{FileError, Source};
pub use file::{Example, document, document_with_heirs, text, title};
pub use heirs::LIKE;
pub use separated::Separated;
pub use table::Table;

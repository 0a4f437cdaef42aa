//! File access. [`read`] reads TOML files and reports each mistake in one line.
//!
//! The rest writes: folders of results and single files. They appear complete or not at all, carry a checksum and never
//! replace files of others. There are also writers in the background and flash simulated in a file.
#![forbid(unsafe_code)]

mod atomic;
mod background;
mod created;
mod error;
mod flash;
mod folder;
mod output;
pub mod read;
pub mod seal;

pub use atomic::{CheckedFile, remove_temporary_files, write_atomically};
pub use background::BackgroundWriter;
pub use created::{remove_created, remove_empty};
pub use error::Error;
pub use flash::{FlashError, FlashFailure, FlashFile};
pub use folder::Folder;
pub use output::OutputFile;

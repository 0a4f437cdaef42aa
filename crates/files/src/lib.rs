//! Files. [`read`]: TOML files, whose mistakes are reported in one line each. The rest is what commands write: folders
//! of results and single files, which appear whole or not at all, carry a checksum and never replace files of others;
//! files and pipes that are written in the background. Flash in a file.
#![forbid(unsafe_code)]

mod background;
mod created;
mod error;
mod flash;
mod folder;
mod output;
mod place;
pub mod read;
pub mod seal;

pub use background::BackgroundWriter;
pub use created::{remove_created, remove_empty};
pub use error::Error;
pub use flash::{Flash, FlashError, FlashFailure};
pub use folder::Folder;
pub use output::Output;
pub use place::{Disk, place, sweep};

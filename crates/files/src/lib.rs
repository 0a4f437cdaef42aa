//! Folders of results: files appear whole or not at all, carry a checksum, and never replace files of others. Flash in
//! a file.
#![forbid(unsafe_code)]

mod error;
mod flash;
mod folder;
mod place;
pub mod seal;

pub use error::Error;
pub use flash::{Flash, FlashError};
pub use folder::Folder;
pub use place::{Disk, place, sweep};

//! Reads PX4's ULog, including the logs of this firmware's black box.
//!
//! A damaged record costs only itself. Reading takes a time that grows with the file's length, whatever the file
//! contains.

mod format;
mod own;
mod reader;
mod records;
mod table;
mod topics;

pub(crate) use format::{FieldType, MessageField, UlogFormat};
pub(crate) use reader::{LogReader, UlogEntry, UlogSubscription, UlogValue};
pub(crate) use records::{FilePiece, each, is_ulog};

use crate::recording::Recording;

/// Reads a log.
///
/// # Errors
/// A message that says what is wrong with the log and what to do.
pub(crate) fn read(bytes: &[u8]) -> Result<Recording, String> {
    let tables = table::read(bytes)?;
    own::recording(&tables)?.map_or_else(|| topics::recording(&tables), Ok)
}

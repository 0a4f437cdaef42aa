//! PX4's ULog, also that of this firmware's black box.
//!
//! Whatever is in a log, a damaged record costs itself, and not the rest, and nothing takes longer than the file is
//! long.

mod format;
mod own;
mod reader;
mod records;
mod table;
mod topics;

pub(crate) use format::{Field, FieldType, Format};
pub(crate) use reader::{Entry, LogReader, LoggedTopic, ParameterValue};
pub(crate) use records::{Piece, each, is_ulog};

use crate::recording::Recording;

/// Reads a log.
///
/// # Errors
/// What is wrong with it, and what to do.
pub(crate) fn read(bytes: &[u8]) -> Result<Recording, String> {
    let tables = table::read(bytes)?;
    own::recording(&tables)?.map_or_else(|| topics::recording(&tables), Ok)
}

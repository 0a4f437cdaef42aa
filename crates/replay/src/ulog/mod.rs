//! PX4's ULog, also that of this firmware's black box.
//!
//! `px4-ulog` parses; records are cut here, so that a damaged one costs itself, and not the rest of the log.

mod own;
mod records;
mod table;
mod topics;

pub(crate) use records::{HEADER, Piece, each, is_ulog};

use crate::recording::Recording;

/// Reads a log.
///
/// # Errors
/// What is wrong with it, and what to do.
pub(crate) fn read(bytes: &[u8]) -> Result<Recording, String> {
    let tables = table::read(bytes)?;
    own::recording(&tables)?.map_or_else(|| topics::recording(&tables), Ok)
}

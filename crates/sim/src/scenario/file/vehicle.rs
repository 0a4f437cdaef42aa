//! `[vehicle]`, what the controller believes, and `[truth]`, what flies.

use crate::reader::{FileError, Table};
use afbc_types::Parameters;

/// The parameters in `table`; those that it leaves out are as in `default`.
pub(super) fn read(table: Option<Table<'_>>, default: Parameters<f64>) -> Result<Parameters<f64>, FileError> {
    let mut vehicle = default;
    if let Some(mut table) = table {
        table.declared(&mut vehicle)?;
        table.finish()?;
    }
    Ok(vehicle)
}

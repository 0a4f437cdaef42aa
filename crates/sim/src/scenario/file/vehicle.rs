//! `[vehicle]`, the nominal parameters, and `[truth]`, the true ones.

use crate::reader::{FileError, Table};
use afbc_types::Parameters;

/// Reads the parameters in `table`; missing keys are as in `default`.
pub(super) fn read(table: Option<Table<'_>>, default: Parameters<f64>) -> Result<Parameters<f64>, FileError> {
    let mut vehicle = default;
    if let Some(mut table) = table {
        table.declared(&mut vehicle)?;
        table.finish()?;
    }
    Ok(vehicle)
}

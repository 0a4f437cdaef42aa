//! `[gains.AXIS]`, `[settings]` and `[limits]` of a file or a contender.

use crate::reader::words::out_of_range;
use crate::reader::{FileError, Table};
use afbc::Settings;
use afbc::fuzzy::Membership;
use afbc_types::{Axis, Declared};

/// Reads gains with a table for each axis; missing keys are unchanged.
pub(super) fn per_axis(table: Option<Table<'_>>, gains: &mut impl Declared) -> Result<(), FileError> {
    let Some(mut table) = table else { return Ok(()) };
    for axis in Axis::ALL {
        if let Some(table) = table.table(axis.name())? {
            group(table, axis.name(), gains)?;
        }
    }
    table.finish()
}

/// Reads gains of the whole vehicle in one table; missing keys are unchanged.
pub(super) fn whole(table: Option<Table<'_>>, gains: &mut impl Declared) -> Result<(), FileError> {
    table.map_or(Ok(()), |table| group(table, "", gains))
}

/// Reads one group of gains, which has a table of its own.
fn group(mut table: Table<'_>, name: &str, gains: &mut impl Declared) -> Result<(), FileError> {
    table.declared_in(name, gains)?;
    // Each gain is in its range; only the combination of centre and width remains to be checked.
    gains.together().map_err(|error| {
        let problem = format!("{}; change one of the two", out_of_range(&error));
        table.fault_at(Membership::CENTRE.range.name, problem)
    })?;
    table.finish()
}

/// Reads `[settings]` and `[limits]` in `parent`; missing keys are as in `default`. Only the file's own have a time
/// step.
pub(super) fn settings(parent: &mut Table<'_>, default: Settings, with_step: bool) -> Result<Settings, FileError> {
    let mut settings = default;
    if let Some(mut table) = parent.table("settings")? {
        let step = afbc_control::Settings::DT.range.name;
        if with_step {
            table.declared(&mut settings)?;
        } else {
            table.forbid(step, "one step serves all contenders; set it in the file's own [settings]")?;
            table.declared_but(step, &mut settings)?;
        }
        table.finish()?;
    }
    if let Some(mut table) = parent.table("limits")? {
        table.declared(&mut settings.limits)?;
        table.finish()?;
    }
    Ok(settings)
}

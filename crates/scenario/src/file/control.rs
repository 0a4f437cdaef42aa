//! Reads `[settings]` and `[limits]` of a file or a contender.

use afbc::Settings;
use afbc_files::read::{FileError, Table};

/// Reads `[settings]` and `[limits]` in `parent`; missing keys are taken from `default`. Only the file's own settings
/// may have a time step.
pub(super) fn settings(parent: &mut Table<'_>, default: Settings, with_step: bool) -> Result<Settings, FileError> {
    let mut settings = default;
    if let Some(mut table) = parent.table("settings")? {
        let step = afbc_control::Settings::DT.range.name;
        if with_step {
            table.declared(&mut settings)?;
        } else {
            table.forbid(step, "all contenders share one time step; set it in the file's own [settings]")?;
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

//! `[gains]`: tables of a law's gains, in scenario files and in vehicle files.

use super::{ControllerKind, Law};
use afbc::fuzzy::Membership;
use afbc_files::read::words::out_of_range;
use afbc_files::read::{FileError, Table};
use afbc_types::{Axis, Declared};
use afbc_vehicles::Vehicle;

/// Gains of which each axis has a table; what is left out stays as it is.
pub(crate) fn per_axis(table: Option<Table<'_>>, gains: &mut impl Declared) -> Result<(), FileError> {
    let Some(mut table) = table else { return Ok(()) };
    for axis in Axis::ALL {
        if let Some(table) = table.table(axis.name())? {
            group(table, axis.name(), gains)?;
        }
    }
    table.finish()
}

/// Gains of the whole vehicle, in one table; what is left out stays as it is.
pub(crate) fn whole(table: Option<Table<'_>>, gains: &mut impl Declared) -> Result<(), FileError> {
    table.map_or(Ok(()), |table| group(table, "", gains))
}

/// One group of gains, which has a table of its own.
fn group(mut table: Table<'_>, name: &str, gains: &mut impl Declared) -> Result<(), FileError> {
    table.declared_in(name, gains)?;
    // Each gain is in its range; what is left to refuse is how centre and width go together.
    table.finish()?;
    gains.together().or_else(|error| {
        let problem = format!("{}; change one of the two", out_of_range(&error));
        table.clash(Membership::CENTRE.range.name, &[], problem)
    })
}

/// `law` with those of its gains that the file of `vehicle` holds.
///
/// # Errors
/// One line on the first thing that is wrong, such as gains of an unknown law.
pub(crate) fn law_gains(vehicle: &Vehicle, law: Law) -> Result<Law, FileError> {
    let read = vehicle.law_gains(|mut laws| {
        let mut law = law;
        // Settings of the cascade are not a law's own.
        laws.table(afbc_vehicles::CASCADE)?;
        for kind in ControllerKind::all() {
            let table = laws.table(kind.name())?;
            match kind == law.kind() {
                true if kind.in_cascade() => per_axis(table, &mut law)?,
                true => whole(table, &mut law)?,
                false => (),
            }
        }
        laws.finish()?;
        Ok(law)
    })?;
    Ok(read.unwrap_or(law))
}

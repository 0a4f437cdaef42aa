//! Reads tables of a law's gains, `[gains]`, in scenario files and in vehicle files.

use super::{ControllerKind, Law};
use afbc::fuzzy::Membership;
use afbc_files::read::words::out_of_range;
use afbc_files::read::{FileError, Table};
use afbc_types::{Axis, Declared};
use afbc_vehicles::Vehicle;

/// Reads gains with a table for each axis; missing gains stay unchanged.
pub(crate) fn per_axis(table: Option<Table<'_>>, gains: &mut impl Declared) -> Result<(), FileError> {
    let Some(mut table) = table else { return Ok(()) };
    for axis in Axis::ALL {
        if let Some(table) = table.table(axis.name())? {
            group(table, axis.name(), gains)?;
        }
    }
    table.finish()
}

/// Reads gains of the whole vehicle from one table; missing gains stay unchanged.
pub(crate) fn whole(table: Option<Table<'_>>, gains: &mut impl Declared) -> Result<(), FileError> {
    table.map_or(Ok(()), |table| group(table, "", gains))
}

/// Reads one group of gains from its table.
fn group(mut table: Table<'_>, name: &str, gains: &mut impl Declared) -> Result<(), FileError> {
    table.declared_in(name, gains)?;
    // Each gain is in its range by now; centre and width may still contradict each other.
    table.finish()?;
    gains.together().or_else(|error| {
        let problem = format!("{}; change the centre or the width", out_of_range(&error));
        table.clash(Membership::CENTRE.range.name, &[], problem)
    })
}

/// Returns `law` with the gains that the vehicle's file has for it.
///
/// # Errors
/// One line on the first mistake, such as gains of an unknown law.
pub(crate) fn law_gains(vehicle: &Vehicle, law: Law) -> Result<Law, FileError> {
    let read = vehicle.law_gains(|mut laws| {
        let mut law = law;
        // The cascade's settings do not belong to a law.
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

//! Reads `[vehicle]`: the nominal parameters, or the name of a vehicle file.

use afbc_files::read::{FileError, Table};
use afbc_types::Parameters;
use afbc_vehicles::{Vehicle, parts};
use std::path::Path;

/// Returns the vehicle that the table names, if any, and the nominal parameters. These are the named vehicle's, or else
/// the paper's with the table's keys in their place.
pub(super) fn read(table: Option<Table<'_>>) -> Result<(Option<Vehicle>, Parameters<f64>), FileError> {
    let Some(mut table) = table else { return Ok((None, Parameters::PAPER)) };
    let Some(name) = table.text("name")? else {
        if !table.knows("name") {
            table.finish()?;
            return Ok((None, Parameters::PAPER));
        }
        return Ok((None, parts::parameters(Some(table), Parameters::PAPER)?));
    };
    let vehicle = named(&table, name)?;
    let parameters = vehicle.parameters;
    table.finish()?;
    Ok((Some(vehicle), parameters))
}

/// Reads a vehicle. A plain name is a built-in vehicle; anything else is a file, relative to the scenario's folder.
fn named(table: &Table<'_>, name: &str) -> Result<Vehicle, FileError> {
    if name.contains(['/', '\\', '.']) {
        let folder = Path::new(table.file()).parent().unwrap_or(Path::new(""));
        return afbc_vehicles::load(&folder.join(name)).map_err(|error| table.through("name", error));
    }
    let built_in = afbc_vehicles::built_in(name).ok_or_else(|| table.fault_at("name", afbc_vehicles::unknown(name)))?;
    built_in.read()
}

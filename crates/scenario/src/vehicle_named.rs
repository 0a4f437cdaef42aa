//! What a vehicle's name stands for.

use crate::contender::{ControllerKind, Law};
use afbc::Profile;
use afbc_reader::FileError;
use afbc_vehicles::{Vehicle, built_in, unknown};
use std::path::Path;

/// Returns the vehicle that `path` stands for, checked, with the gains of its file: a plain name is a built-in one
/// first, then a file.
///
/// # Errors
/// The first mistake, as one line.
pub fn vehicle_named(path: &Path) -> Result<Vehicle, FileError> {
    let plain = path.to_str().filter(|text| !text.contains(['/', '\\', '.']));
    let vehicle = match plain {
        Some(name) => match built_in(name) {
            Some(known) => known.read(),
            None if !path.exists() => Err(FileError::whole("vehicle", unknown(name))),
            None => afbc_vehicles::load(path),
        },
        None => afbc_vehicles::load(path),
    }?;
    // Gains of every law, so that a slip in a table's name is reported whoever flies.
    Law::on(ControllerKind::Afbc, &vehicle, Profile::Flight)?;
    Ok(vehicle)
}

//! Finds a vehicle by its name.

use crate::contender::{ControllerKind, Law};
use afbc::Profile;
use afbc_files::read::FileError;
use afbc_vehicles::{BUILT_IN, Vehicle, built_in, unknown};
use std::path::Path;

/// Reads and checks the vehicle that `path` names, including the gains in its file. A plain name is first looked up
/// among the built-in vehicles, then as a file.
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
    // Reads the gains of every law, so that a misspelt table is reported whichever law flies.
    Law::on(ControllerKind::Afbc, &vehicle, Profile::Flight)?;
    Ok(vehicle)
}

/// Reads and checks a vehicle from its `text`, with the gains of every law. `file` is its path in errors; `name` is its
/// name if the text gives none.
///
/// # Errors
/// Every mistake, each as one line.
pub fn vehicle_of(file: &str, text: &str, name: &str) -> Result<Vehicle, FileError> {
    let read = afbc_vehicles::parse(file, text, name);
    // If the file has other mistakes, its gains are checked on a built-in vehicle.
    let base = match &read {
        Ok(vehicle) => Some(vehicle.clone()),
        Err(_) => BUILT_IN.iter().find_map(|known| known.read().ok()),
    };
    let base = base.map(|base| base.with_law_gains(file, text));
    let gains = |vehicle: &Vehicle| {
        let of = |kind| Law::on(kind, vehicle, Profile::Flight).err();
        ControllerKind::all().into_iter().filter_map(of).reduce(FileError::and)
    };
    match (read, base.as_ref().and_then(gains)) {
        (read, None) => read,
        (Ok(_), Some(gains)) => Err(gains),
        (Err(error), Some(gains)) => Err(error.and(gains)),
    }
}

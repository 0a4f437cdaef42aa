//! A vehicle's parameters in a file, stored by the firmware's code.

use afbc_comms::services::signing::SigningRecord;
use afbc_files::{FlashError, FlashFailure, FlashFile};
use afbc_hil::Host;
use afbc_onboard::Link;
use afbc_onboard::parameters::{Kept, RecordChange};
use afbc_scenario::Scenario;
use afbc_store::{Error, Store, hash};
use afbc_types::OutOfRange;
use std::io::ErrorKind;
use std::path::Path;

/// Vehicle name for a scenario without a vehicle file.
const PAPER: &str = "paper";

/// A parameter store in a file. The file is written in the background, so that no tick waits for the disk.
pub struct ParameterFile(Store<FlashFile>, FlashFailure);

impl ParameterFile {
    /// Opens or creates the file at `path` for the vehicle of `scenario`.
    ///
    /// # Errors
    /// Fails with one line that names the file.
    pub fn open(path: &Path, scenario: &Scenario) -> Result<Self, String> {
        let name = scenario.vehicle_file.as_ref().map_or(PAPER, |vehicle| &vehicle.name);
        let flash = FlashFile::open(path).map_err(|error| match error.kind() {
            ErrorKind::NotFound => format!("{}: its folder does not exist; make it first", path.display()),
            _ => format!("{}: {error}", path.display()),
        })?;
        let (flash, failure) = flash.in_background().map_err(|error| format!("{}: {error}", path.display()))?;
        let store = Store::open(flash, 0, hash(name.as_bytes()));
        Ok(ParameterFile(store.map_err(|error| format!("{}: {error}", path.display()))?, failure))
    }

    /// Powers up the firmware of `scenario`'s vehicle with the stored parameters. Link parameters that are not stored
    /// have the values of `link`. Calls `notice` with one line per stored parameter that is not used.
    pub(crate) fn power_up(
        &mut self,
        scenario: &Scenario,
        link: Link,
        mut notice: impl FnMut(&str),
    ) -> Result<Host, OutOfRange> {
        // Erase at the start, as the board does.
        if let Err(error) = self.0.make_room() {
            notice(error.reason());
        }
        Host::stored(scenario.vehicle_file.as_ref(), link, &mut self.0, &mut notice)
    }

    /// Returns why writing to the disk failed; a failure is returned once.
    pub(crate) fn take_failure(&self) -> Option<Error<FlashError>> {
        self.1.take().map(Error::Flash)
    }

    /// Stores a change of a parameter.
    pub(crate) fn store_change(&mut self, change: RecordChange) -> Result<(), Error<FlashError>> {
        self.write(|store| Kept::NOW.keep(store, change))
    }

    /// Stores a part of the signing key.
    pub(crate) fn store_signing(&mut self, record: SigningRecord) -> Result<(), Error<FlashError>> {
        self.write(|store| store.set(record.name, 0, record.bits))
    }

    fn write(
        &mut self,
        write: impl Fn(&mut Store<FlashFile>) -> Result<(), Error<FlashError>>,
    ) -> Result<(), Error<FlashError>> {
        match write(&mut self.0) {
            // Erase at once; the board would have to wait until it may stand still.
            Err(Error::NeedsErase) => {
                self.0.make_room()?;
                write(&mut self.0)
            }
            done => done,
        }
    }
}

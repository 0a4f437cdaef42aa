//! The parameters of a vehicle in a file, by the firmware's code.

use afbc_files::{Flash, FlashError, FlashFailure};
use afbc_hil::Host;
use afbc_onboard::Link;
use afbc_onboard::parameters::{Kept, RecordChange};
use afbc_scenario::Scenario;
use afbc_station::services::signing::SigningRecord;
use afbc_store::{Error, Store, hash};
use afbc_types::OutOfRange;
use std::io::ErrorKind;
use std::path::Path;

/// Vehicle of a scenario without a vehicle file.
const PAPER: &str = "paper";

/// A store of parameters in a file, which is written in the background: no tick waits for a disk.
pub struct ParameterFile(Store<Flash>, FlashFailure);

impl ParameterFile {
    /// Opens the file at `path` for the vehicle of `scenario`, or makes it.
    ///
    /// # Errors
    /// One line that names the file.
    pub fn open(path: &Path, scenario: &Scenario) -> Result<Self, String> {
        let name = scenario.vehicle_file.as_ref().map_or(PAPER, |vehicle| &vehicle.name);
        let flash = Flash::open(path).map_err(|error| match error.kind() {
            ErrorKind::NotFound => format!("{}: its folder does not exist; make it first", path.display()),
            _ => format!("{}: {error}", path.display()),
        })?;
        let (flash, failure) = flash.in_background().map_err(|error| format!("{}: {error}", path.display()))?;
        let store = Store::open(flash, 0, hash(name.as_bytes()));
        Ok(ParameterFile(store.map_err(|error| format!("{}: {error}", path.display()))?, failure))
    }

    /// Powers up the firmware of `scenario`'s vehicle with these parameters, by default these of the link; calls
    /// `notice` with a line on each that is not used.
    pub(crate) fn power_up(
        &mut self,
        scenario: &Scenario,
        link: Link,
        mut notice: impl FnMut(&str),
    ) -> Result<Host, OutOfRange> {
        // As on the board: erased at the start.
        if let Err(error) = self.0.make_room() {
            notice(error.reason());
        }
        Host::stored(scenario.vehicle_file.as_ref(), link, &mut self.0, &mut notice)
    }

    /// Returns why something that was written has not got to the disk, once.
    pub(crate) fn take_failure(&self) -> Option<Error<FlashError>> {
        self.1.take().map(Error::Flash)
    }

    /// Writes a change.
    pub(crate) fn keep(&mut self, change: RecordChange) -> Result<(), Error<FlashError>> {
        self.write(|store| Kept::NOW.keep(store, change))
    }

    /// Writes a part of the key of signatures.
    pub(crate) fn keep_signing(&mut self, record: SigningRecord) -> Result<(), Error<FlashError>> {
        self.write(|store| store.set(record.name, 0, record.bits))
    }

    fn write(
        &mut self,
        write: impl Fn(&mut Store<Flash>) -> Result<(), Error<FlashError>>,
    ) -> Result<(), Error<FlashError>> {
        match write(&mut self.0) {
            // Nothing stands still meanwhile, as it would on the board.
            Err(Error::NeedsErase) => {
                self.0.make_room()?;
                write(&mut self.0)
            }
            done => done,
        }
    }
}

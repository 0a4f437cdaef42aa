//! Which contenders fly a scenario.

use crate::Scenario;
use crate::contender::{Contender, ControllerKind};
use afbc::Profile;
use afbc_reader::FileError;

impl Scenario {
    /// Keeps the contenders named in `names`, or whose law is, and adds the laws named that no contender flies, with
    /// their default gains for this vehicle.
    ///
    /// # Errors
    /// One line on a name that is unknown, or on a gain or setting out of range on this vehicle.
    pub fn choose(&mut self, names: &[String]) -> Result<(), FileError> {
        let called = |contender: &Contender, name: &str| contender.name == name || contender.kind().name() == name;
        for name in names {
            if self.contenders.iter().any(|contender| called(contender, name)) {
                continue;
            }
            let Some(kind) = ControllerKind::named(name) else {
                return Err(self.unknown_contender(name));
            };
            let mut contender = Contender::of(kind, Profile::Paper);
            contender = match &self.vehicle_file {
                Some(vehicle) => contender.on(vehicle, Profile::Flight)?,
                None => contender.for_vehicle(&self.vehicle),
            };
            // A scenario keeps what its [settings] say nowhere but in its contenders.
            if let Some(other) = self.contenders.first() {
                contender.settings = other.settings;
            }
            self.contenders.push(contender);
        }
        self.contenders.retain(|contender| names.iter().any(|name| called(contender, name)));
        self.check().map_err(|error| FileError::whole(&self.name, error.to_string()))
    }

    fn unknown_contender(&self, name: &str) -> FileError {
        let laws = ControllerKind::names();
        let own: Vec<_> = self.contenders.iter().map(|contender| contender.name.as_str()).collect();
        let problem = format!("no such controller; the laws are {laws}, the scenario's contenders {}", own.join(", "));
        FileError::whole(&format!("controller {}", name.escape_debug()), problem)
    }
}

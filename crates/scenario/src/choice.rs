//! Chooses the contenders that fly a scenario.

use crate::Scenario;
use crate::contender::{Contender, has_printed_cascade};
use afbc::Profile;
use afbc_files::read::FileError;
use afbc_files::read::words::cure;

impl Scenario {
    /// Keeps the contenders whose name or law is in `names`. A named law that no contender flies is added with its
    /// default gains for this vehicle.
    ///
    /// # Errors
    /// One line on an unknown name, or on a gain or setting that is out of range for this vehicle.
    pub fn choose(&mut self, names: &[String]) -> Result<(), FileError> {
        let called = |contender: &Contender, name: &str| contender.name == name || contender.kind().name() == name;
        for name in names {
            if self.contenders.iter().any(|contender| called(contender, name)) {
                continue;
            }
            let Some(contender) = Contender::named(name) else {
                return Err(self.unknown_contender(name));
            };
            self.contenders.push(self.settled(contender)?);
        }
        self.contenders.retain(|contender| names.iter().any(|name| called(contender, name)));
        self.check().map_err(|error| FileError::whole(&self.name, error.to_string()))
    }

    /// Gives a standard contender the scenario's profile, vehicle and settings. A printed law keeps its own profile.
    fn settled(&self, contender: Contender) -> Result<Contender, FileError> {
        // The scenario's profile and [settings] are stored only in its contenders.
        let first = self.contenders.first();
        let is_printed = first.is_some_and(|first| has_printed_cascade(&first.settings));
        let contender = match is_printed {
            true => Contender { name: contender.name, ..Contender::of(contender.law.kind(), Profile::Paper) },
            false => contender,
        };
        let contender = self.carried(contender)?;
        let Some(first) = first else { return Ok(contender) };
        let settings = match contender.is_printed() == is_printed || !contender.kind().in_cascade() {
            true => first.settings,
            false => contender.settings.with_dt_s(first.settings.common.dt_s),
        };
        Ok(Contender { settings, ..contender })
    }

    /// Gives a standard contender its gains for this scenario's vehicle.
    ///
    /// # Errors
    /// One line on the mistake in the gains of the vehicle's file.
    pub fn carried(&self, contender: Contender) -> Result<Contender, FileError> {
        let profile = contender.kept_profile();
        match &self.vehicle_file {
            Some(vehicle) => contender.on(vehicle, profile),
            None => Ok(contender.for_vehicle(&self.vehicle)),
        }
    }

    fn unknown_contender(&self, name: &str) -> FileError {
        let standard: Vec<_> = Contender::all_standard().map(|contender| contender.name).collect();
        let own = self.contenders.iter().map(|contender| &contender.name).filter(|own| !standard.contains(own));
        let cure = cure(name, standard.iter().chain(own).map(String::as_str));
        let problem = format!("no such controller; {cure}");
        FileError::whole(&format!("controller {}", name.escape_debug()), problem)
    }
}

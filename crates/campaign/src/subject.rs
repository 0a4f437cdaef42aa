//! Reads the scenario, campaign or vehicle with a given name, from a file or from the built-in ones.

use crate::built_in;
use crate::plan::Campaign;
use afbc_files::read::{BuiltIn, FileError};
use afbc_scenario::{Scenario, vehicle_of};
use afbc_vehicles::Vehicle;
use std::path::{Path, PathBuf};
use toml::de::DeTable;

/// Kind of object that a file describes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SubjectKind {
    /// A scenario, flown by `sitl fly`.
    Scenario,
    /// A campaign, flown by `sitl campaign`.
    Campaign,
    /// A vehicle, flown with the option `--vehicle`.
    Vehicle,
}

/// A scenario, campaign or vehicle read from its file.
#[derive(Clone, Debug)]
pub enum Subject {
    /// A scenario, flown by `sitl fly`.
    Scenario(Scenario),
    /// A campaign, flown by `sitl campaign`.
    Campaign(Campaign),
    /// A vehicle, flown with the option `--vehicle`.
    Vehicle(Box<Vehicle>),
}

/// A file that was found but not yet parsed.
struct FoundFile {
    kind: SubjectKind,
    /// The name as given.
    shown: String,
    /// File name in error messages.
    file: String,
    text: String,
    /// Name of the scenario or campaign, unless the text gives another.
    name: String,
    /// Folder to which paths in the file are relative.
    folder: PathBuf,
}

/// Top-level keys that only a campaign has.
const CAMPAIGN: [&str; 4] = ["flights", "spread", "scenario", "trajectories"];
/// Top-level keys that only a vehicle has.
const VEHICLE: [&str; 2] = ["motor", "rotor"];
/// Top-level key that every scenario has and no campaign has.
const SCENARIO: &str = "trajectory";

impl SubjectKind {
    const fn name(self) -> &'static str {
        match self {
            SubjectKind::Scenario => "scenario",
            SubjectKind::Campaign => "campaign",
            SubjectKind::Vehicle => "vehicle",
        }
    }

    /// Returns the built-in object of another kind called `name`.
    fn other(self, name: &str) -> Option<FoundFile> {
        let all = [SubjectKind::Scenario, SubjectKind::Campaign, SubjectKind::Vehicle];
        all.into_iter().filter(|kind| *kind != self).find_map(|kind| kind.built_in(name))
    }

    /// Returns the kind of the file with this `text`; none if the keys do not tell.
    fn of(text: &str) -> Option<SubjectKind> {
        let document = DeTable::parse(text).ok()?;
        let has = |key: &str| document.get_ref().contains_key(key);
        match has(SCENARIO) {
            true => Some(SubjectKind::Scenario),
            false if CAMPAIGN.into_iter().any(has) => Some(SubjectKind::Campaign),
            false => VEHICLE.into_iter().any(has).then_some(SubjectKind::Vehicle),
        }
    }

    fn built_in(self, name: &str) -> Option<FoundFile> {
        let text = match self {
            SubjectKind::Scenario => afbc_scenario::built_in(name)?.text,
            SubjectKind::Campaign => built_in::built_in(name)?.text,
            SubjectKind::Vehicle => afbc_vehicles::built_in(name)?.text,
        };
        let file = format!("built-in {name}");
        let [shown, name] = [name; 2].map(str::to_owned);
        Some(FoundFile { kind: self, shown, file, text: text.into(), name, folder: PathBuf::new() })
    }

    fn similar(self, name: &str) -> Option<&'static str> {
        match self {
            SubjectKind::Scenario => afbc_scenario::similar_built_in(name).map(|known| known.name),
            SubjectKind::Campaign => built_in::similar_built_in(name).map(|known| known.name),
            SubjectKind::Vehicle => BuiltIn::similar(&afbc_vehicles::BUILT_IN, name).map(|known| known.name),
        }
    }

    /// Returns the error for a `name` that is neither built in nor a file.
    pub fn unknown(self, name: &str) -> FileError {
        if let Some(Err(refused)) = self.other(name).map(|found| found.only(self)) {
            return refused;
        }
        let kind = self.name();
        let cure = match self.similar(name) {
            Some(known) => format!("did you mean {known}?"),
            None => format!("`sitl {kind}s` lists what is built in; for a file, write its path, as in ./my.toml"),
        };
        FileError::whole(name, format!("no such {kind}; {cure}"))
    }
}

impl FoundFile {
    /// Finds `path`. A plain name means a built-in object of this `kind`, else a file, else a built-in object of
    /// another kind.
    fn at(path: &Path, kind: SubjectKind) -> Result<Self, FileError> {
        let plain = path.to_str().filter(|text| !text.contains(['/', '\\', '.']));
        if let Some(found) = plain.and_then(|name| kind.built_in(name)) {
            return Ok(found);
        }
        if let Some(name) = plain.filter(|_| !path.exists()) {
            return kind.other(name).ok_or_else(|| kind.unknown(name));
        }
        let text = afbc_files::read::text(path, kind.name())?;
        let shown = path.display().to_string();
        Ok(FoundFile {
            kind: SubjectKind::of(&text).unwrap_or(kind),
            file: shown.clone(),
            shown,
            text,
            name: path.file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned()),
            folder: path.parent().unwrap_or(Path::new("")).into(),
        })
    }

    /// Returns the file if it is of this kind, or else an error that says how to fly it.
    fn only(self, kind: SubjectKind) -> Result<Self, FileError> {
        let FoundFile { kind: found, shown, .. } = &self;
        let problem = match found {
            _ if *found == kind => return Ok(self),
            SubjectKind::Scenario => format!(
                "this is a scenario; fly it with `sitl fly {shown}`; `sitl campaigns robustness` prints a campaign"
            ),
            SubjectKind::Campaign => format!("this is a campaign; fly it with `sitl campaign {shown}`"),
            SubjectKind::Vehicle => format!("this is a vehicle; fly it with `sitl fly hover --vehicle {shown}`"),
        };
        Err(FileError::whole(shown, problem))
    }

    fn scenario(&self) -> Result<Scenario, FileError> {
        afbc_scenario::parse(&self.file, &self.text, &self.name)
    }

    fn vehicle(&self) -> Result<Vehicle, FileError> {
        vehicle_of(&self.file, &self.text, &self.name)
    }

    fn campaign(&self) -> Result<Campaign, FileError> {
        crate::file::parse(&self.file, &self.text, &self.name, &self.folder)
    }
}

/// Reads and checks the scenario at `path`.
///
/// # Errors
/// The first error, as one line. A campaign or vehicle is also an error.
pub fn scenario(path: &Path) -> Result<Scenario, FileError> {
    FoundFile::at(path, SubjectKind::Scenario)?.only(SubjectKind::Scenario)?.scenario()
}

/// Reads and checks the campaign at `path`.
///
/// # Errors
/// The first error, as one line. A scenario or vehicle is also an error.
pub fn campaign(path: &Path) -> Result<Campaign, FileError> {
    FoundFile::at(path, SubjectKind::Campaign)?.only(SubjectKind::Campaign)?.campaign()
}

/// Reads and checks the scenario, campaign or vehicle at `path`.
///
/// # Errors
/// All mistakes, one line each.
pub fn any(path: &Path) -> Result<Subject, FileError> {
    let found = FoundFile::at(path, SubjectKind::Scenario)?;
    match found.kind {
        SubjectKind::Scenario => found.scenario().map(Subject::Scenario),
        SubjectKind::Campaign => found.campaign().map(Subject::Campaign),
        SubjectKind::Vehicle => found.vehicle().map(|vehicle| Subject::Vehicle(Box::new(vehicle))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_built_in_file_is_recognised_by_its_text() {
        for known in &afbc_scenario::BUILT_IN {
            assert_eq!(SubjectKind::of(known.text), Some(SubjectKind::Scenario), "{}", known.name);
        }
        for known in &built_in::BUILT_IN {
            assert_eq!(SubjectKind::of(known.text), Some(SubjectKind::Campaign), "{}", known.name);
        }
        for known in &afbc_vehicles::BUILT_IN {
            assert_eq!(SubjectKind::of(known.text), Some(SubjectKind::Vehicle), "{}", known.name);
        }
        assert_eq!(SubjectKind::of(""), None);
        assert_eq!(SubjectKind::of("[trajectory"), None);
    }
}

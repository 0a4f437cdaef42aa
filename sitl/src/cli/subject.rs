//! What a name on the command line stands for: a scenario or a campaign, built in or in a file.

use afbc_campaign::{self as campaign, Campaign};
use afbc_sim::reader::{self, FileError};
use afbc_sim::scenario::{self, Scenario};
use std::path::{Path, PathBuf};
use toml::de::DeTable;

/// What can be asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// What `sitl fly` flies.
    Scenario,
    /// What `sitl campaign` flies.
    Campaign,
}

/// What there is.
#[derive(Clone, Debug)]
pub(crate) enum Subject {
    /// What `sitl fly` flies.
    Scenario(Scenario),
    /// What `sitl campaign` flies.
    Campaign(Campaign),
}

/// What has been found, unread.
struct Found {
    kind: Kind,
    /// As it was asked for.
    shown: String,
    /// What errors in the text are errors of.
    file: String,
    text: String,
    /// What it is called if it gives itself no name.
    name: String,
    /// Where it looks for files.
    folder: PathBuf,
}

/// Keys at the top of a file that only a campaign has.
const CAMPAIGN: [&str; 4] = ["flights", "spread", "scenario", "trajectories"];
/// And one that only a scenario has, and no scenario lacks.
const SCENARIO: &str = "trajectory";

impl Kind {
    const fn name(self) -> &'static str {
        match self {
            Kind::Scenario => "scenario",
            Kind::Campaign => "campaign",
        }
    }

    const fn other(self) -> Kind {
        match self {
            Kind::Scenario => Kind::Campaign,
            Kind::Campaign => Kind::Scenario,
        }
    }

    /// What the `text` of a file is; none if it could be either.
    fn of(text: &str) -> Option<Kind> {
        let document = DeTable::parse(text).ok()?;
        let has = |key: &str| document.get_ref().contains_key(key);
        match has(SCENARIO) {
            true => Some(Kind::Scenario),
            false => CAMPAIGN.into_iter().any(has).then_some(Kind::Campaign),
        }
    }

    fn built_in(self, name: &str) -> Option<Found> {
        let text = match self {
            Kind::Scenario => scenario::built_in(name)?.text,
            Kind::Campaign => campaign::built_in(name)?.text,
        };
        let file = format!("built-in {name}");
        let [shown, name] = [name; 2].map(str::to_owned);
        Some(Found { kind: self, shown, file, text: text.into(), name, folder: PathBuf::new() })
    }

    fn similar(self, name: &str) -> Option<&'static str> {
        match self {
            Kind::Scenario => scenario::similar_built_in(name).map(|known| known.name),
            Kind::Campaign => campaign::similar_built_in(name).map(|known| known.name),
        }
    }

    /// The one line for a `name` that neither stands for anything built in nor is a file's.
    pub(crate) fn unknown(self, name: &str) -> FileError {
        if let Some(Err(refused)) = self.other().built_in(name).map(|found| found.only(self)) {
            return refused;
        }
        let kind = self.name();
        let cure = match self.similar(name) {
            Some(known) => format!("did you mean {known}?"),
            None => format!("`sitl {kind}s` lists the built-in ones; a file needs its path, as in ./my.toml"),
        };
        FileError::whole(name, format!("no such {kind}; {cure}"))
    }
}

impl Found {
    /// What `path` stands for: a plain name is a built-in one of this `kind` first, then a file, then a built-in one of the
    /// other kind.
    fn at(path: &Path, kind: Kind) -> Result<Self, FileError> {
        let plain = path.to_str().filter(|text| !text.contains(['/', '\\', '.']));
        if let Some(found) = plain.and_then(|name| kind.built_in(name)) {
            return Ok(found);
        }
        if let Some(name) = plain.filter(|_| !path.exists()) {
            return kind.other().built_in(name).ok_or_else(|| kind.unknown(name));
        }
        let text = reader::text(path, kind.name())?;
        let shown = path.display().to_string();
        Ok(Found {
            kind: Kind::of(&text).unwrap_or(kind),
            file: shown.clone(),
            shown,
            text,
            name: path.file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned()),
            folder: path.parent().unwrap_or(Path::new("")).into(),
        })
    }

    /// Itself, if it is what was asked for.
    fn only(self, kind: Kind) -> Result<Self, FileError> {
        let Found { kind: found, shown, .. } = &self;
        let problem = match found {
            _ if *found == kind => return Ok(self),
            Kind::Scenario => format!(
                "this is a scenario: sitl fly {shown}; `sitl campaigns robustness` prints a campaign that flies one many times"
            ),
            Kind::Campaign => format!("this is a campaign: sitl campaign {shown}"),
        };
        Err(FileError::whole(shown, problem))
    }

    fn scenario(&self) -> Result<Scenario, FileError> {
        scenario::parse(&self.file, &self.text, &self.name)
    }

    fn campaign(&self) -> Result<Campaign, FileError> {
        campaign::parse(&self.file, &self.text, &self.name, &self.folder)
    }
}

/// The scenario that `path` stands for, checked.
///
/// # Errors
/// One line on the first thing that is wrong, such as that it is a campaign.
pub(crate) fn scenario(path: &Path) -> Result<Scenario, FileError> {
    Found::at(path, Kind::Scenario)?.only(Kind::Scenario)?.scenario()
}

/// The campaign that `path` stands for, checked.
///
/// # Errors
/// One line on the first thing that is wrong, such as that it is a scenario.
pub(crate) fn campaign(path: &Path) -> Result<Campaign, FileError> {
    Found::at(path, Kind::Campaign)?.only(Kind::Campaign)?.campaign()
}

/// Whichever of the two `path` stands for, checked.
///
/// # Errors
/// One line on the first thing that is wrong.
pub(crate) fn either(path: &Path) -> Result<Subject, FileError> {
    let found = Found::at(path, Kind::Scenario)?;
    match found.kind {
        Kind::Scenario => found.scenario().map(Subject::Scenario),
        Kind::Campaign => found.campaign().map(Subject::Campaign),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_built_in_file_is_told_by_its_text() {
        for known in &scenario::BUILT_IN {
            assert_eq!(Kind::of(known.text), Some(Kind::Scenario), "{}", known.name);
        }
        for known in &campaign::BUILT_IN {
            assert_eq!(Kind::of(known.text), Some(Kind::Campaign), "{}", known.name);
        }
        assert_eq!(Kind::of(""), None);
        assert_eq!(Kind::of("[trajectory"), None);
    }
}

//! A scenario or campaign named on the command line.

use super::terminal::Failure;
use afbc_campaign::Campaign;
use afbc_campaign::subject::{self, Subject};
use afbc_scenario::Scenario;
use std::ffi::OsString;
use std::fmt;
use std::path::{Path, PathBuf};

/// The name of a built-in one, or the path of a file.
#[derive(Clone, Debug)]
pub(crate) struct Target(PathBuf);

impl<P: Into<OsString>> From<P> for Target {
    fn from(path: P) -> Self {
        Target(path.into().into())
    }
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.display().fmt(f)
    }
}

impl Target {
    /// Returns what was given, as a path.
    pub(crate) fn path(&self) -> &Path {
        &self.0
    }

    /// Reads and checks the scenario.
    pub(crate) fn scenario(&self) -> Result<Scenario, Failure> {
        Ok(subject::scenario(&self.0)?)
    }

    /// Reads and checks the campaign.
    pub(crate) fn campaign(&self) -> Result<Campaign, Failure> {
        Ok(subject::campaign(&self.0)?)
    }

    /// Reads and checks the scenario or campaign.
    pub(crate) fn either(&self) -> Result<Subject, Failure> {
        Ok(subject::either(&self.0)?)
    }
}

//! Scenario, campaign or vehicle named on the command line.

use super::terminal::CommandError;
use afbc_campaign::Campaign;
use afbc_campaign::subject::{self, Subject};
use afbc_scenario::Scenario;
use std::ffi::OsString;
use std::fmt;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Name of a built-in scenario, campaign or vehicle, or path of a file.
#[derive(Clone, Debug)]
pub(crate) struct TargetArg(PathBuf);

impl<P: Into<OsString>> From<P> for TargetArg {
    fn from(path: P) -> Self {
        TargetArg(path.into().into())
    }
}

impl fmt::Display for TargetArg {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.display().fmt(f)
    }
}

impl TargetArg {
    /// Returns the argument as a path.
    pub(crate) fn path(&self) -> &Path {
        &self.0
    }

    /// Reads and checks the scenario.
    pub(crate) fn scenario(&self) -> Result<Scenario, CommandError> {
        Ok(subject::scenario(self.no_plan()?)?)
    }

    /// Reads and checks the campaign.
    pub(crate) fn campaign(&self) -> Result<Campaign, CommandError> {
        Ok(subject::campaign(self.no_plan()?)?)
    }

    /// Reads and checks the scenario, campaign or vehicle.
    pub(crate) fn any(&self) -> Result<Subject, CommandError> {
        Ok(subject::any(self.no_plan()?)?)
    }

    /// Returns the argument as a path; fails if it is a ground station's plan.
    fn no_plan(&self) -> Result<&Path, CommandError> {
        match is_plan(&self.0) && self.0.exists() {
            true => {
                Err(format!("{self}: a ground station's plan, not a scenario; fly it with `sitl fly {self}`").into())
            }
            false => Ok(&self.0),
        }
    }
}

/// True if the path names a plan of QGroundControl, or a file that holds a mission as text.
pub(super) fn is_plan(path: &Path) -> bool {
    let is_mission = || {
        let mut head = [0; 12];
        let read = File::open(path).and_then(|mut file| file.read(&mut head));
        read.is_ok_and(|length| head.get(..length).is_some_and(afbc_serve::is_waypoint_file))
    };
    // A pipe is not read here, since its content would be lost.
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("plan")) || path.is_file() && is_mission()
}

//! A scenario as it is named on the command line.

use super::Failure;
use sitl::scenario::{Scenario, built_in, load, similar_built_in};
use std::ffi::OsString;
use std::path::PathBuf;

/// The name of a built-in scenario, or the path of a file.
#[derive(Clone, Debug)]
pub(crate) struct Target(PathBuf);

impl<P: Into<OsString>> From<P> for Target {
    fn from(path: P) -> Self {
        Target(path.into().into())
    }
}

impl Target {
    /// The scenario, checked. A plain name is a built-in scenario first, then a file.
    pub(crate) fn scenario(&self) -> Result<Scenario, Failure> {
        let Target(path) = self;
        let Some(name) = path.to_str().filter(|text| !text.contains(['/', '\\', '.'])) else {
            return Ok(load(path)?);
        };
        match built_in(name) {
            Some(built_in) => Ok(built_in.scenario()?),
            None if path.exists() => Ok(load(path)?),
            None => Err(unknown(name)),
        }
    }
}

/// There is neither a built-in scenario nor a file of that name.
pub(crate) fn unknown(name: &str) -> Failure {
    let cure = match similar_built_in(name) {
        Some(known) => format!("did you mean {}?", known.name),
        None => "`sitl scenarios` lists the built-in ones; a file needs its path, as in ./my.toml".into(),
    };
    format!("{}: no such scenario; {cure}", name.escape_debug()).into()
}

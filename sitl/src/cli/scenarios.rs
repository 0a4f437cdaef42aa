//! `sitl scenarios` and `sitl check`: what can be flown.

use super::target::{Target, unknown};
use super::{Failure, print};
use clap::Args;
use sitl::scenario::{BUILT_IN, Contender, Scenario, built_in};
use std::process::ExitCode;

/// List the built-in scenarios, or print one of them to start from
///
/// `sitl scenarios hover > my.toml` makes a scenario file to change and to fly with `sitl fly my.toml`.
#[derive(Args, Debug)]
pub(crate) struct Scenarios {
    /// Built-in scenario to print
    name: Option<String>,
}

impl Scenarios {
    /// Prints the list or the file.
    pub(super) fn run(self) -> Result<ExitCode, Failure> {
        match self.name {
            Some(name) => print(built_in(&name).ok_or_else(|| unknown(&name))?.text)?,
            None => print(&list()?)?,
        }
        Ok(ExitCode::SUCCESS)
    }
}

fn list() -> Result<String, Failure> {
    let mut list = String::new();
    for built_in in BUILT_IN {
        let Scenario { duration_s, description, .. } = built_in.scenario()?;
        list += &format!("{:<12}{duration_s:>4} s  {description}\n", built_in.name);
    }
    Ok(list)
}

/// Check a scenario without flying it; exits with 2 and one line on the first error
#[derive(Args, Debug)]
pub(crate) struct Check {
    /// Name of a built-in scenario, or path of a scenario file
    scenario: Target,
}

impl Check {
    /// Prints what would be flown.
    pub(super) fn run(self) -> Result<ExitCode, Failure> {
        let Scenario { name, duration_s, model, contenders, .. } = self.scenario.scenario()?;
        let laws: Vec<_> = contenders.iter().map(Contender::title).collect();
        print(&format!("{name}: ok, {duration_s} s, {} plant, {}\n", model.name(), laws.join(", ")))?;
        Ok(ExitCode::SUCCESS)
    }
}

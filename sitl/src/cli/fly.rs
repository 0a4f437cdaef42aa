//! `sitl fly`: one scenario.

use super::Failure;
use super::flying::{Flying, report};
use super::target::Target;
use clap::{Args, ValueEnum};
use sitl::scenario::ControllerKind;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Fly a built-in scenario or a scenario file; exits with 1 if a vehicle is lost
#[derive(Args, Debug)]
pub(crate) struct Fly {
    /// Name of a built-in scenario, or path of a scenario file
    scenario: Target,

    /// Law to fly with, instead of the scenario's; may be given more than once
    #[arg(long = "controller", value_name = "LAW", value_enum)]
    controllers: Vec<Controller>,

    #[command(flatten)]
    flying: Flying,

    /// Folder for logs, figures and report [default: out/ and the scenario's name]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum Controller {
    /// Adaptive fuzzy backstepping
    Afbc,
    /// Classical backstepping
    Backstepping,
}

impl Controller {
    fn kind(self) -> ControllerKind {
        match self {
            Controller::Afbc => ControllerKind::Afbc,
            Controller::Backstepping => ControllerKind::Backstepping,
        }
    }
}

impl Fly {
    /// Flies, writes, prints.
    pub(super) fn run(self) -> Result<ExitCode, Failure> {
        let mut scenario = self.scenario.scenario()?;
        if !self.controllers.is_empty() {
            // In the order of the laws, whatever the order they were asked for in; none twice.
            scenario.controllers = ControllerKind::ALL.to_vec();
            scenario.controllers.retain(|kind| self.controllers.iter().any(|controller| controller.kind() == *kind));
        }
        let out = self.out.unwrap_or_else(|| Path::new("out").join(&scenario.name));
        let flown = self.flying.fly(vec![scenario], &out)?;
        report(&out, &flown, &[])?;
        Ok(ExitCode::from(u8::from(flown.iter().any(|flown| flown.run.lost.is_some()))))
    }
}

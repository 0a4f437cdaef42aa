//! `sitl pil`: flies the firmware on an emulated processor.

#[cfg(unix)]
mod emulated;

use super::in_the_loop::InTheLoop;
use super::target::Target;
use super::terminal::Failure;
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;

/// Fly the firmware on an emulated processor in lockstep, and compare every output of every tick with the host's
///
/// QEMU runs the firmware's machine code (built by this command or `cargo fw-pil`). The plant runs on the host, and
/// both exchange only the link's bytes. Exits with 0 only if no bit differs and the vehicle was not lost.
#[derive(Args, Debug)]
pub(crate) struct Pil {
    /// Name of a built-in scenario, or path of a scenario file
    #[arg(default_value = "paper")]
    scenario: Target,

    #[command(flatten)]
    flying: InTheLoop,

    /// Image to fly, instead of building the one of this source
    #[arg(long, value_name = "ELF")]
    image: Option<PathBuf>,
}

impl Pil {
    /// Builds the image, flies it and prints the results.
    pub(super) fn run(self) -> Result<ExitCode, Failure> {
        let scenario = self.flying.scenario(&self.scenario)?;
        emulated::fly(&scenario, &self.flying, self.image)
    }
}

#[cfg(not(unix))]
mod emulated {
    use super::{ExitCode, Failure, InTheLoop, PathBuf};
    use afbc_scenario::Scenario;

    pub(super) fn fly(_: &Scenario, _: &InTheLoop, _: Option<PathBuf>) -> Result<ExitCode, Failure> {
        Err("the emulator needs Unix, for its pipes and sockets; `sitl fly` flies the same scenario without it".into())
    }
}

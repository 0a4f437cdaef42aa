//! `sitl pil`: flies the firmware on an emulated processor.

#[cfg(unix)]
mod emulated;

use super::in_the_loop::InTheLoopArgs;
use super::target::TargetArg;
use super::terminal::CommandError;
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;

/// Fly the firmware on an emulated processor in lockstep, and compare each tick's outputs with the host's
///
/// QEMU runs the firmware's machine code (built by this command or `cargo fw-pil`). The plant runs on the host and
/// exchanges only the link's bytes with QEMU. Exits with 0 only if no bit differs and the vehicle was not lost.
#[derive(Args, Debug)]
pub(crate) struct PilArgs {
    /// Name of a built-in scenario, or path of a scenario file
    #[arg(default_value = "paper")]
    scenario: TargetArg,

    #[command(flatten)]
    flying: InTheLoopArgs,

    /// Image to fly, instead of building one from this source
    #[arg(long, value_name = "ELF")]
    image: Option<PathBuf>,
}

impl PilArgs {
    /// Builds the image, flies it and prints the results.
    pub(super) fn run(self) -> Result<ExitCode, CommandError> {
        let scenario = self.flying.scenario(&self.scenario)?;
        emulated::fly(&scenario, &self.flying, self.image)
    }
}

#[cfg(not(unix))]
mod emulated {
    use super::{CommandError, ExitCode, InTheLoopArgs, PathBuf};
    use afbc_scenario::Scenario;

    pub(super) fn fly(_: &Scenario, _: &InTheLoopArgs, _: Option<PathBuf>) -> Result<ExitCode, CommandError> {
        Err("the emulator needs Unix pipes and sockets; `sitl fly` flies the same scenario without the emulator".into())
    }
}

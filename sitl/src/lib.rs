//! Command line of the simulator, for programs that add laws of their own.
//!
//! ```no_run
//! use afbc_scenario::{OwnController, OwnLaw, OwnVehicle};
//! use afbc_types::{Inputs, Setpoint, State};
//!
//! /// Carries the weight and does nothing else.
//! struct Float(OwnVehicle);
//!
//! impl OwnController for Float {
//!     fn step(&mut self, _: &State, _: &Setpoint, _fresh: bool) -> Inputs {
//!         Inputs { thrust_n: self.0.parameters.weight_n(), ..Inputs::default() }
//!     }
//! }
//!
//! fn main() -> std::process::ExitCode {
//!     // `cargo run --release -- fly hover --controller float`, `-- compare --suite field`, `-- tune float` and so on.
//!     sitl::main_with([OwnLaw::new("float", |vehicle| Float(*vehicle))])
//! }
//! ```
#![forbid(unsafe_code)]

mod cli;
#[cfg(feature = "all")]
mod network;
#[cfg(feature = "all")]
mod serial;

use afbc_scenario::OwnLaw;
use std::process::ExitCode;

/// Runs the command line with these laws in addition to the built-in ones. They are available in every command that
/// flies, in scenario and vehicle files, in suites, campaigns and searches for gains.
///
/// Exit codes:
/// - 0: success.
/// - 1: a vehicle was lost unexpectedly, or an exact replay differs.
/// - 2: a law cannot be registered, nothing was flown or the results could not be written; stderr has one line about
///   it.
/// - 130: interrupted; one line says whether nothing was written or a campaign's finished flights are kept.
pub fn main_with(laws: impl IntoIterator<Item = OwnLaw>) -> ExitCode {
    if let Some(problem) = laws.into_iter().find_map(|law| law.register().err()) {
        eprintln!("{problem}");
        return ExitCode::from(2);
    }
    // Exits if a shell has asked for completions.
    #[cfg(feature = "all")]
    clap_complete::CompleteEnv::with_factory(cli::Cli::program).complete();
    match cli::Cli::read().run() {
        Ok(code) => code,
        Err(failure) => {
            // An empty log would block the next attempt.
            afbc_files::remove_empty();
            eprintln!("{failure}");
            ExitCode::from(2)
        }
    }
}

//! Flies the adaptive fuzzy backstepping controller and its baseline in software, from the command line.
//!
//! Exit codes: 0, all went as it should; 1, a vehicle was lost that should not have been; 2, nothing was flown or its
//! results could not be written, and one line on stderr says why; 130, it was interrupted: nothing was written, or
//! what a campaign has flown is kept; one line says which.

mod cli;
mod serial;

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    match cli::Cli::parse().run() {
        Ok(code) => code,
        Err(failure) => {
            eprintln!("{failure}");
            ExitCode::from(2)
        }
    }
}

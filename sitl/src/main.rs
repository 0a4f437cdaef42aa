//! Command line of the simulator.
//!
//! Exit codes: 0 for success; 1 if a vehicle was lost unexpectedly, or an exact replay differs; 2 if nothing was flown
//! or the results could not be written, with one line on stderr; 130 if interrupted, with one line that says whether
//! nothing was written or a campaign's finished flights are kept.

mod cli;
mod network;
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

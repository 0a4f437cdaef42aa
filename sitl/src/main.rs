//! Simulator. Documented by `--help` and [`sitl::main_with`].

use std::process::ExitCode;

fn main() -> ExitCode {
    sitl::main_with([])
}

//! `--json`: results as JSON on stdout. docs/json.md lists every key.

use super::terminal::{CommandError, print};
use clap::Args;
use serde::Serialize;
use std::io;

/// Option of every command with a JSON output.
#[derive(Args, Clone, Copy, Debug)]
pub(crate) struct JsonArgs {
    /// Print JSON instead; docs/json.md describes the format
    #[arg(long)]
    pub(crate) json: bool,
}

/// Prints the output of `write`.
pub(crate) fn print_written(write: impl FnOnce(&mut Vec<u8>) -> io::Result<()>) -> Result<(), CommandError> {
    let mut text = Vec::new();
    write(&mut text)?;
    print(&String::from_utf8(text)?)
}

/// Prints one value.
pub(crate) fn print_value(value: &impl Serialize) -> Result<(), CommandError> {
    print(&(serde_json::to_string_pretty(value)? + "\n"))
}

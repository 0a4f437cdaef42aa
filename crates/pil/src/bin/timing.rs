//! Computes the worst response times of every board and writes the tables of `docs/timing.md`; with `--check`, writes
//! nothing. Fails if one exceeds its deadline.

use pil::Error;
use pil::timing::{page, reports};
use std::path::Path;
use std::process::ExitCode;

/// The pages with the counts, and with the times.
const BUDGETS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/budgets.md");
const DOCUMENT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/timing.md");

fn main() -> ExitCode {
    match run() {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("timing: {error}");
            ExitCode::FAILURE
        }
    }
}

/// True if every response is within its deadline.
fn run() -> Result<bool, Error> {
    let reports = reports(&std::fs::read_to_string(BUDGETS)?)?;
    for report in &reports {
        println!("{}", report.text);
    }
    if !std::env::args().any(|argument| argument == "--check") {
        let path = Path::new(DOCUMENT);
        let text = std::fs::read_to_string(path)?;
        std::fs::write(path, page(&text, &reports)?)?;
    }
    let over: Vec<_> = reports.iter().flat_map(|report| &report.over).collect();
    for name in &over {
        eprintln!("timing: over its deadline: {name}");
    }
    Ok(over.is_empty())
}

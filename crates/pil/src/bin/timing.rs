//! Computes the worst response times of every board and writes the tables of `docs/reference/timing-tables.md`; with
//! `--check`, compares them. Fails if a response exceeds its deadline and is not known to, or is later than known.

use pil::Error;
use pil::timing::{page, reports};
use std::path::Path;
use std::process::ExitCode;

/// Page with the instruction counts, and page with the times.
const BUDGETS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/budgets.md");
const DOCUMENT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/reference/timing-tables.md");

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

/// Returns true if every response is within its deadline or known to be late.
fn run() -> Result<bool, Error> {
    let reports = reports(&std::fs::read_to_string(BUDGETS)?)?;
    let mut wrong: Vec<_> = reports.iter().flat_map(|report| report.wrong.iter().cloned()).collect();
    let path = Path::new(DOCUMENT);
    let text = std::fs::read_to_string(path)?;
    let written = page(&text, &reports)?;
    if !std::env::args().any(|argument| argument == "--check") {
        std::fs::write(path, written)?;
    } else if written != text {
        wrong.push(format!("{DOCUMENT} is out of date; `cargo run --release -p pil --bin timing` updates its tables"));
    }
    for wrong in &wrong {
        eprintln!("timing: {wrong}");
    }
    if wrong.is_empty() {
        println!("timing: {} kinds of boards; every task is in time or listed in known.rs as late", reports.len());
    }
    Ok(wrong.is_empty())
}

//! `manifest.json` beside results: what they were made of, by which command, on which machine.

use super::terminal::Failure;
use afbc_campaign::hash_of;
use afbc_files::Folder;
use afbc_files::seal::{self, hash_of_file};
use afbc_scenario::Scenario;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::env;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::thread;

/// Name of the file.
pub(super) const NAME: &str = "manifest.json";
/// Options that say where results go, each with a value; and those that say how they are printed.
const WHERE: [&str; 4] = ["--out", "--ulog", "--exact-log", "--mcap"];
const HOW: [&str; 2] = ["--force", "--json"];

/// What results were made of.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct ResultsManifest {
    /// Version of the program.
    pub(super) version: String,
    /// Commit of the sources that the program was built from, with `-dirty` if they had been changed; null if unknown.
    pub(super) commit: Option<String>,
    /// The command line behind the program's name, without what says where results go.
    pub(super) command: Vec<String>,
    /// Hash of version, scenarios, vehicles, contenders with their gains, and seeds.
    pub(super) fingerprint: String,
    /// What was flown.
    pub(super) flown: Vec<FlownWords>,
    /// What it was flown on; results do not depend on it.
    pub(super) machine: Machine,
    /// Hash of every file of the results.
    pub(super) results: BTreeMap<String, String>,
    checksum: String,
}

/// A scenario that was flown.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct FlownWords {
    name: String,
    /// Seed of every flight of each contender.
    seeds: Vec<u64>,
    /// Vehicle, contenders with their gains, weather, sensors: everything that decides a flight.
    scenario: Value,
}

#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Machine {
    os: String,
    architecture: String,
    cores: usize,
}

/// Returns the version of the program.
pub(super) fn version() -> String {
    env!("CARGO_PKG_VERSION").into()
}

/// Returns the commit of the program's sources, if it is known.
pub(super) fn commit() -> Option<String> {
    option_env!("SITL_COMMIT").map(String::from)
}

/// A scenario, and the seeds that each contender flew it with.
pub(super) type Flown<'a> = (&'a Scenario, Vec<u64>);

/// Writes the manifest of the results `files` in `folder`, of which everything in `flown` decides, and `shown` is
/// written out.
pub(super) fn write(
    folder: &Folder,
    files: &[PathBuf],
    flown: &[Flown<'_>],
    shown: &[Flown<'_>],
) -> Result<(), Failure> {
    let words = |(scenario, seeds): &Flown<'_>| {
        Ok(FlownWords { name: scenario.name.clone(), seeds: seeds.clone(), scenario: serde_json::to_value(scenario)? })
    };
    let hash = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Ok((name, hash_of_file(path)?))
    };
    let manifest = ResultsManifest {
        version: version(),
        commit: commit(),
        command: command(env::args_os().skip(1).map(|argument| argument.to_string_lossy().into_owned())),
        fingerprint: hash_of(&(version(), flown)),
        flown: shown.iter().map(words).collect::<Result<_, serde_json::Error>>()?,
        machine: Machine {
            os: env::consts::OS.into(),
            architecture: env::consts::ARCH.into(),
            cores: thread::available_parallelism().map_or(1, usize::from),
        },
        results: files.iter().map(hash).collect::<io::Result<_>>()?,
        checksum: seal::OPEN.into(),
    };
    folder.add(&[NAME])?;
    folder.place(NAME, |out| seal::json(out, &manifest))?;
    Ok(())
}

/// Returns the arguments that decide the results.
fn command(arguments: impl Iterator<Item = String>) -> Vec<String> {
    let mut kept = Vec::new();
    let mut arguments = arguments.into_iter();
    while let Some(argument) = arguments.next() {
        if WHERE.contains(&argument.as_str()) {
            arguments.next();
        } else if !HOW.contains(&argument.as_str()) && !WHERE.iter().any(|it| argument.starts_with(&format!("{it}="))) {
            kept.push(argument);
        }
    }
    kept
}

/// Reads the manifest at `path`, or in the folder `path`.
pub(super) fn read(path: &Path) -> Result<ResultsManifest, Failure> {
    let path = if path.is_dir() { path.join(NAME) } else { path.to_path_buf() };
    let name = path.display();
    let cure = "name the manifest.json of a folder of results";
    let bytes = fs::read(&path).map_err(|error| format!("{name}: cannot be read ({error}); {cure}"))?;
    let damaged = |problem: &dyn std::fmt::Display| format!("{name}: damaged or no manifest ({problem}); {cure}");
    seal::verify(&mut io::Cursor::new(&bytes)).map_err(|error| damaged(&error))?;
    Ok(serde_json::from_slice(&bytes).map_err(|error| damaged(&error))?)
}

#[cfg(test)]
mod tests {
    use super::command;

    #[test]
    fn a_command_is_kept_without_its_places() {
        for (given, kept) in [
            ("compare storm --out x --seeds 3 --force", "compare storm --seeds 3"),
            ("compare --out=x --json --suite field", "compare --suite field"),
            ("fly hover --ulog a.ulg --mcap=b --duration 3", "fly hover --duration 3"),
            ("--out", ""),
        ] {
            assert_eq!(command(given.split(' ').map(String::from)).join(" "), kept);
        }
    }
}

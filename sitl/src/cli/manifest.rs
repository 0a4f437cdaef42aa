//! `manifest.json` in a folder of results: inputs, command, and machine that made them.

use super::terminal::CommandError;
use afbc_files::Folder;
use afbc_files::seal::{self, hash_of, hash_of_file};
use afbc_scenario::Scenario;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::env;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::thread;

/// Name of the manifest's file.
pub(super) const NAME: &str = "manifest.json";
/// Options that do not affect results, but where they are written, how they are printed or how many cores make them:
/// options with a value, and options without one.
pub(super) const WITH_VALUE: [&str; 7] =
    ["--out", "--ulog", "--exact-log", "--mcap", "--write", "--table", "--threads"];
pub(super) const WITHOUT_VALUE: [&str; 2] = ["--force", "--json"];

/// Content of a manifest.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct ResultsManifest {
    /// Version of the program.
    pub(super) version: String,
    /// Commit of the program's sources, with `-dirty` if they were modified; null if unknown.
    pub(super) commit: Option<String>,
    /// Command line after the program's name, without options that do not affect results.
    pub(super) command: Vec<String>,
    /// Hash of version, scenarios, vehicles, contenders with their gains, and seeds.
    pub(super) fingerprint: String,
    /// Scenarios that were flown.
    pub(super) flown: Vec<FlownJson>,
    /// Machine that made the results; results do not depend on it.
    pub(super) machine: HostMachine,
    /// Hash of each file of the results.
    pub(super) results: BTreeMap<String, String>,
    checksum: String,
}

/// Scenario that was flown.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct FlownJson {
    name: String,
    /// Seeds of each contender's flights.
    seeds: Vec<u64>,
    /// Everything that decides a flight: vehicle, contenders with their gains, weather, sensors.
    scenario: Value,
}

#[derive(Debug, Serialize, Deserialize)]
pub(super) struct HostMachine {
    os: String,
    architecture: String,
    cores: usize,
}

/// Returns the version of the program.
pub(super) fn version() -> String {
    env!("CARGO_PKG_VERSION").into()
}

/// Returns the commit of the program's sources, if known.
pub(super) fn commit() -> Option<String> {
    option_env!("SITL_COMMIT").map(String::from)
}

/// Scenario, and the seeds of each contender's flights.
pub(super) type FlownScenario<'a> = (&'a Scenario, Vec<u64>);

/// Returns the manifest's entry for a scenario.
pub(super) fn words((scenario, seeds): &FlownScenario<'_>) -> Result<FlownJson, serde_json::Error> {
    Ok(FlownJson { name: scenario.name.clone(), seeds: seeds.clone(), scenario: serde_json::to_value(scenario)? })
}

/// Writes the manifest of the results `files` in `folder`. All of `flown` enters the fingerprint; only `shown` is
/// written out.
pub(super) fn write(
    folder: &Folder,
    files: &[PathBuf],
    flown: &[FlownScenario<'_>],
    shown: &[FlownScenario<'_>],
) -> Result<(), CommandError> {
    let shown = shown.iter().map(words).collect::<Result<_, serde_json::Error>>()?;
    write_as(folder, files, own_command(), hash_of(&(version(), flown)), shown)
}

/// Writes the manifest of the results `files` in `folder`, made by `command`.
pub(super) fn write_as(
    folder: &Folder,
    files: &[PathBuf],
    command: Vec<String>,
    fingerprint: String,
    flown: Vec<FlownJson>,
) -> Result<(), CommandError> {
    let hash = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Ok((name, hash_of_file(path)?))
    };
    let manifest = ResultsManifest {
        version: version(),
        commit: commit(),
        command,
        fingerprint,
        flown,
        machine: HostMachine {
            os: env::consts::OS.into(),
            architecture: env::consts::ARCH.into(),
            cores: thread::available_parallelism().map_or(1, usize::from),
        },
        results: files.iter().map(hash).collect::<io::Result<_>>()?,
        checksum: seal::OPEN.into(),
    };
    folder.add(&[NAME])?;
    folder.write(NAME, |out| seal::json(out, &manifest))?;
    Ok(())
}

/// Returns this program's command and those of its arguments that affect the results.
pub(super) fn own_command() -> Vec<String> {
    let own = command(env::args_os().skip(1).map(|argument| argument.to_string_lossy().into_owned()));
    // Without a command, or with options first, the command is `paper`.
    let named = own.first().is_some_and(|word| !word.starts_with('-'));
    if named { own } else { [vec!["paper".into()], own].concat() }
}

/// Returns the arguments that affect the results.
fn command(arguments: impl Iterator<Item = String>) -> Vec<String> {
    let mut kept = Vec::new();
    let mut arguments = arguments.into_iter();
    while let Some(argument) = arguments.next() {
        let name = argument.split_once('=').map_or(argument.as_str(), |(name, _)| name);
        match (WITH_VALUE.contains(&name), name == argument) {
            (true, true) => drop(arguments.next()),
            (false, _) if !WITHOUT_VALUE.contains(&name) => kept.push(argument),
            _ => {}
        }
    }
    kept
}

/// Reads the manifest at `path`, or the one in the folder `path`.
pub(super) fn read(path: &Path) -> Result<ResultsManifest, CommandError> {
    let path = if path.is_dir() { path.join(NAME) } else { path.to_path_buf() };
    let name = path.display();
    let cure = "name the manifest.json of a folder of results";
    let bytes = fs::read(&path).map_err(|error| format!("{name}: cannot be read ({error}); {cure}"))?;
    let damaged =
        |problem: &dyn std::fmt::Display| format!("{name}: the file is damaged or no manifest ({problem}); {cure}");
    seal::verify(&mut io::Cursor::new(&bytes)).map_err(|error| damaged(&error))?;
    let manifest: ResultsManifest = serde_json::from_slice(&bytes).map_err(|error| damaged(&error))?;
    // A manifest from somebody else must not name files outside its folder.
    let is_plain = |name: &String| Path::new(name).file_name().is_some_and(|plain| plain == name.as_str());
    match manifest.results.keys().find(|name| !is_plain(name)) {
        Some(name) => Err(damaged(&format!("a path in it, {}", name.escape_debug())).into()),
        None => Ok(manifest),
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]
    use super::{WITH_VALUE, WITHOUT_VALUE, command};
    use crate::cli::Cli;
    use clap::CommandFactory;

    /// Every new option must be listed here too, because `sitl again` runs all options that are not declared harmless.
    #[test]
    fn each_option_decides_results_or_is_a_place() {
        let decide: [(&str, &[&str]); 4] = [
            ("campaign", &["campaign", "flights", "shard", "flight", "contenders", "log_hz", "vehicle"]),
            (
                "compare",
                &[
                    "scenarios",
                    "suite",
                    "controllers",
                    "seeds",
                    "against",
                    "vehicle",
                    "seed",
                    "flights",
                    "on_estimate",
                    "duration",
                    "from",
                ],
            ),
            ("fly", &["scenario", "controllers", "vehicle", "duration", "seed", "log_hz"]),
            ("paper", &["reading", "inertia", "thrust", "no_uncertainty", "plant", "duration", "log_hz"]),
        ];
        let program = Cli::command();
        for (command, decide) in decide {
            for arg in program.find_subcommand(command).unwrap().get_arguments() {
                let long = format!("--{}", arg.get_long().unwrap_or_default());
                let with = WITH_VALUE.contains(&long.as_str());
                let place = with || WITHOUT_VALUE.contains(&long.as_str());
                assert!(place != decide.contains(&arg.get_id().as_str()), "{command} {long}");
                let takes_one = arg.get_action().takes_values();
                assert!(!place || with == takes_one, "{command} {long}");
            }
        }
    }

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

//! `sitl again`: repeats the command in a manifest, and compares the results.

use super::manifest::{self, NAME, ResultsManifest, WITH_VALUE, WITHOUT_VALUE};
use super::terminal::{CommandError, print, say};
use afbc_files::seal::hash_of_file;
use clap::parser::ValueSource;
use clap::{Arg, ArgMatches, Args, Command as CliCommand};
use std::env;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

/// Commands that write a manifest.
const WITH_MANIFEST: [&str; 4] = ["campaign", "compare", "fly", "paper"];
/// Command that resumes in an existing folder instead of starting afresh.
const RESUMES: &str = "campaign";

/// Repeat results from their manifest, and compare them byte by byte
///
/// Runs the command that the manifest names into another folder, and compares every file with the manifest's hash.
/// Paths in the command are relative to the current folder. Somebody else's manifest is safe to run: the command cannot
/// write anywhere but into this folder. Exits with 1 if a file differs.
#[derive(Args, Debug)]
pub(crate) struct AgainArgs {
    /// Folder of results, or its manifest.json
    manifest: PathBuf,

    /// Folder for the new results [default: the manifest's folder with -again]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

impl AgainArgs {
    /// Runs the command, compares the results and prints the differences.
    pub(super) fn run(self, program: CliCommand) -> Result<ExitCode, CommandError> {
        let before = manifest::read(&self.manifest)?;
        let command =
            checked(&before.command, &program).map_err(|problem| format!("{}: {problem}", self.manifest.display()))?;
        let out = self.out.clone().unwrap_or_else(|| beside(&self.manifest));
        if command == RESUMES && out.exists() {
            return Err(format!(
                "{}: the folder exists already; choose another folder with --out, or remove this one",
                out.display()
            )
            .into());
        }
        for (what, then, now) in [
            ("version", Some(before.version.clone()), Some(manifest::version())),
            ("commit", before.commit.clone(), manifest::commit()),
        ] {
            if then != now {
                let word = |it: Option<String>| it.unwrap_or_else(|| "unknown".into());
                say(&format!(
                    "{what}: {} when the results were made, {} now; results may differ",
                    word(then),
                    word(now)
                ));
            }
        }
        // Runs this program's own file, since another `sitl` in the path may have another version.
        let status = Command::new(env::current_exe()?)
            .arg(&command)
            .arg("--out")
            .arg(&out)
            .args(before.command.iter().skip(usize::from(is_named(&before.command))))
            .stdout(Stdio::null())
            .status()
            .map_err(|error| format!("the command cannot be run again ({error})"))?;
        // Exit code 1 means that a vehicle was lost, which is a valid result.
        if !matches!(status.code(), Some(0 | 1)) {
            return Err(format!(
                "sitl {}: the command failed, see above; nothing was compared",
                before.command.join(" ")
            )
            .into());
        }
        let after = manifest::read(&out)?;
        let differences = differences(&before, &after, &out);
        if differences.is_empty() {
            let files = before.results.len();
            print(&format!("the same bytes: {files} files in {} equal those of the manifest\n", out.display()))?;
            return Ok(ExitCode::SUCCESS);
        }
        let cause = if before.fingerprint == after.fingerprint {
            "the inputs are the same, so the program or the machine's arithmetic differs"
        } else {
            "the inputs differ: a file that the command names, a gain or the program has changed"
        };
        print(&format!("{}\n{cause}\n", differences.join("\n")))?;
        Ok(ExitCode::FAILURE)
    }
}

/// True if the arguments begin with a command. Without a command, or with options first, the command is `paper`.
fn is_named(arguments: &[String]) -> bool {
    arguments.first().is_some_and(|word| !word.starts_with('-'))
}

/// Returns the command of a manifest's arguments. Fails if the command, or one of its options, is not safe to run for
/// a manifest written by somebody else.
fn checked(arguments: &[String], program: &CliCommand) -> Result<String, String> {
    let command = if is_named(arguments) { arguments.first().map_or("", String::as_str) } else { "paper" };
    let known = WITH_MANIFEST.join(", ");
    let unknown =
        || format!("the manifest's command is {:?}, which is none of {known}", command.escape_debug().to_string());
    let name = WITH_MANIFEST.iter().find(|known| **known == command).ok_or_else(unknown)?;
    let options = program.find_subcommand(name).ok_or_else(unknown)?;
    let rest = arguments.iter().skip(usize::from(is_named(arguments)));
    let words = [*name].into_iter().chain(rest.map(String::as_str));
    let given: ArgMatches = options.clone().no_binary_name(false).try_get_matches_from(words).map_err(|error| {
        let line = error.to_string();
        format!("the manifest's command cannot be run: {}", line.lines().next().unwrap_or_default())
    })?;
    let is_given = |arg: &&Arg| given.value_source(arg.get_id().as_str()) == Some(ValueSource::CommandLine);
    match places(options).find(is_given).and_then(Arg::get_long) {
        Some(place) => Err(format!(
            "the manifest's command has --{place}, an option that `sitl again` does not run; run the command \
             yourself if you trust it"
        )),
        None => Ok((*name).into()),
    }
}

/// Returns the options of a command that do not affect its results.
fn places(options: &CliCommand) -> impl Iterator<Item = &Arg> {
    let of = |arg: &&Arg, names: &[&str]| {
        arg.get_long().is_some_and(|long| names.iter().any(|name| name.strip_prefix("--") == Some(long)))
    };
    options.get_arguments().filter(move |arg| of(arg, &WITH_VALUE) || of(arg, &WITHOUT_VALUE))
}

/// Returns the default folder for the new results, next to the manifest's.
fn beside(manifest: &Path) -> PathBuf {
    let is_file = manifest.file_name().is_some_and(|name| name == NAME);
    let folder = if is_file { manifest.parent().unwrap_or(Path::new("")) } else { manifest };
    match folder.file_name() {
        Some(name) => {
            let mut name: OsString = name.into();
            name.push("-again");
            folder.with_file_name(name)
        }
        None => PathBuf::from("again"),
    }
}

/// Returns a line for each file that differs, is missing or is new.
fn differences(before: &ResultsManifest, after: &ResultsManifest, out: &Path) -> Vec<String> {
    let changed = before.results.iter().filter_map(|(name, then)| match hash_of_file(&out.join(name)) {
        Ok(now) if now == *then => None,
        Ok(_) => Some(format!("{name}: differs")),
        Err(_) => Some(format!("{name}: not made again")),
    });
    let new = after.results.keys().filter(|name| !before.results.contains_key(*name));
    changed.chain(new.map(|name| format!("{name}: the manifest does not have this file"))).collect()
}

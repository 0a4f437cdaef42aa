//! `sitl again`: the same results from their manifest.

use super::manifest::{self, NAME, ResultsManifest};
use super::terminal::{Failure, print, say};
use afbc_files::seal::hash_of_file;
use clap::Args;
use std::env;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

/// Commands that leave a manifest.
const WITH_MANIFEST: [&str; 3] = ["compare", "fly", "paper"];

/// Make results again from their manifest, and compare them byte by byte
///
/// Runs the command that the manifest names, with the results in a folder of their own, and compares every file with
/// the manifest's hash. Paths of the command are relative to the current folder. Exits with 1 if a file differs.
#[derive(Args, Debug)]
pub(crate) struct Again {
    /// manifest.json of a folder of results, or the folder
    manifest: PathBuf,

    /// Folder for the new results [default: the manifest's folder with -again]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

impl Again {
    /// Runs the command, compares, prints.
    pub(super) fn run(self) -> Result<ExitCode, Failure> {
        let before = manifest::read(&self.manifest)?;
        // Without a command, or with options first, it is `paper`.
        let command = before.command.first().filter(|word| !word.starts_with('-')).map_or("paper", String::as_str);
        if !WITH_MANIFEST.contains(&command) {
            let (path, known) = (self.manifest.display(), WITH_MANIFEST.join(", "));
            return Err(format!("{path}: its command is {command:?}, not one of {known}").into());
        }
        let out = self.out.clone().unwrap_or_else(|| beside(&self.manifest));
        for (what, then, now) in [
            ("version", Some(before.version.clone()), Some(manifest::version())),
            ("commit", before.commit.clone(), manifest::commit()),
        ] {
            if then != now {
                let word = |it: Option<String>| it.unwrap_or_else(|| "unknown".into());
                say(&format!("{what}: {} then, {} now; results may differ", word(then), word(now)));
            }
        }
        // This very program: another of the same name in the path may be of another version.
        let status = Command::new(env::current_exe()?)
            .args(&before.command)
            .arg("--out")
            .arg(&out)
            .stdout(Stdio::null())
            .status()
            .map_err(|error| format!("the command cannot be run again ({error})"))?;
        // 1 says that a vehicle was lost, which is a result.
        if !matches!(status.code(), Some(0 | 1)) {
            return Err(format!("sitl {}: failed, see above; nothing was compared", before.command.join(" ")).into());
        }
        let after = manifest::read(&out)?;
        let differences = differences(&before, &after, &out);
        if differences.is_empty() {
            let files = before.results.len();
            print(&format!("the same bytes: {files} files in {} are those of the manifest\n", out.display()))?;
            return Ok(ExitCode::SUCCESS);
        }
        let cause = if before.fingerprint == after.fingerprint {
            "what was flown is the same; the program or the machine's arithmetic is another"
        } else {
            "what was flown is not the same: a file that the command names, a gain or the program has changed"
        };
        print(&format!("{}\n{cause}\n", differences.join("\n")))?;
        Ok(ExitCode::FAILURE)
    }
}

/// Returns the folder of new results beside those of the manifest.
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
    changed.chain(new.map(|name| format!("{name}: was not there before"))).collect()
}

//! Tells the program the commit of its sources, if git knows it: results name it in their manifest.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Inputs other than the commit that change the program.
const SOURCES: [&str; 4] = ["build.rs", "src", "../crates", "../vehicles"];

fn main() {
    let head = ["HEAD", "logs/HEAD"].iter().filter_map(|name| git(&["rev-parse", "--git-path", name]));
    // A path that is not there would make every build a new one.
    let watched = SOURCES.map(PathBuf::from).into_iter().flat_map(|path| watched(&path)).chain(head.map(PathBuf::from));
    watched.filter(|path| path.exists()).for_each(|path| println!("cargo:rerun-if-changed={}", path.display()));
    let changed = git(&[&["status", "--porcelain", "--"], &SOURCES[..]].concat());
    if let (Some(commit), Some(changed)) = (git(&["rev-parse", "HEAD"]), changed) {
        let dirty = if changed.is_empty() { "" } else { "-dirty" };
        println!("cargo:rustc-env=SITL_COMMIT={commit}{dirty}");
    }
}

/// Returns a path or, of the folder of all crates, what is in each of them, without what npm has put there.
fn watched(path: &Path) -> Vec<PathBuf> {
    let inside = |path: &Path| fs::read_dir(path).into_iter().flatten().flatten().map(|entry| entry.path());
    if path.ends_with("crates") {
        inside(path).flat_map(|path| inside(&path)).filter(|path| !path.ends_with("node_modules")).collect()
    } else {
        vec![path.to_owned()]
    }
}

/// Returns what git prints; none without git, or outside a repository.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok().filter(|output| output.status.success())?;
    Some(String::from_utf8(output.stdout).ok()?.trim().to_owned())
}

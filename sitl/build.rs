//! Tells the program the commit of its sources, if git knows it: results name it in their manifest.

use std::path::Path;
use std::process::Command;

/// Whatever changes the program, beside the commit.
const SOURCES: [&str; 4] = ["build.rs", "src", "../crates", "../vehicles"];

fn main() {
    let head = ["HEAD", "logs/HEAD"].iter().filter_map(|name| git(&["rev-parse", "--git-path", name]));
    // A path that is not there would make every build a new one.
    let watched = SOURCES.map(String::from).into_iter().chain(head).filter(|path| Path::new(path).exists());
    watched.for_each(|path| println!("cargo:rerun-if-changed={path}"));
    let changed = git(&[&["status", "--porcelain", "--"], &SOURCES[..]].concat());
    if let (Some(commit), Some(changed)) = (git(&["rev-parse", "HEAD"]), changed) {
        let dirty = if changed.is_empty() { "" } else { "-dirty" };
        println!("cargo:rustc-env=SITL_COMMIT={commit}{dirty}");
    }
}

/// Returns what git prints; none without git, or outside a repository.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok().filter(|output| output.status.success())?;
    Some(String::from_utf8(output.stdout).ok()?.trim().to_owned())
}

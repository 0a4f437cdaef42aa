//! Ctrl-C: commands without partial results end at once, with one line.

#![expect(clippy::unwrap_used, reason = "tests")]

mod common;

use common::{command, folder};
use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Command, Stdio};

/// Sends `signal` to `sitl` once it has reported progress on stderr; returns its exit code and the rest of stderr.
fn interrupted(folder: &Path, arguments: &[&str], signal: &str) -> (Option<i32>, String) {
    let mut child = command(folder, arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut said = BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    while !line.contains(": 0 of ") {
        line.clear();
        assert_ne!(said.read_line(&mut line).unwrap(), 0, "it ended before it flew");
    }
    assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
    let mut rest = String::new();
    said.read_to_string(&mut rest).unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.stdout.is_empty(), "{arguments:?}");
    (output.status.code(), rest)
}

#[test]
fn ends_with_one_line_and_writes_nothing() {
    let folder = folder("at-once");
    let page = "<!-- results: begin -->\nas before\n<!-- results: end -->\n";
    fs::write(folder.join("page.md"), page).unwrap();
    // Each would take minutes.
    for arguments in [
        &["fly", "storm", "--duration", "36000"] as &[&str],
        &["paper", "--duration", "36000"],
        &["compare", "--seeds", "10000"],
        &["results"],
        &["results", "--write", "page.md"],
    ] {
        for signal in ["-INT", "-TERM"] {
            let (code, said) = interrupted(&folder, arguments, signal);
            assert_eq!(code, Some(130), "{arguments:?}: {said}");
            assert_eq!(said.lines().last(), Some("stopped before the end; nothing was written"), "{arguments:?}");
        }
    }
    assert_eq!(fs::read_to_string(folder.join("page.md")).unwrap(), page);
    let results =
        |name: &str| fs::read_dir(folder.join("out").join(name)).unwrap().flatten().map(|entry| entry.file_name());
    for name in ["storm", "paper", "compare"] {
        let written: Vec<_> = results(name).filter(|file| !file.to_string_lossy().starts_with('.')).collect();
        assert!(written.is_empty(), "{written:?}");
    }
}

//! Tests Ctrl-C: commands without partial results end at once, with one line, and leave nothing that blocks the next
//! attempt.

#![expect(clippy::unwrap_used, reason = "tests")]

use crate::common::{command, folder};
use std::ffi::OsString;
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
    // Each of these commands would take minutes.
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

/// Mission to a place 400 m away.
const FAR: &str = "QGC WPL 110\n\
    0\t1\t0\t16\t0\t0\t0\t0\t47.397742\t8.545594\t488\t1\n\
    1\t0\t3\t22\t0\t0\t0\t0\t47.397742\t8.545594\t10\t1\n\
    2\t0\t3\t16\t0\t0\t0\t0\t47.401342\t8.545594\t10\t1\n";

/// An interrupted flight's logs are removed, whether the laws alone or already the firmware's code is flying. The same
/// command can then be repeated.
#[test]
fn leaves_no_log_behind() {
    let folder = folder("logs");
    let logs = ["--exact-log", "flight.log", "--ulog", "flight.ulg", "--mcap", "flight.mcap"];
    let long = ["fly", "storm", "--duration", "36000"];
    let files = || fs::read_dir(&folder).unwrap().flatten().map(|it| it.file_name()).filter(|it| it != "out");
    for options in [&logs[..], &logs[4..], &logs[..2], &logs[..4]] {
        for signal in ["-INT", "-TERM"] {
            let (code, said) = interrupted(&folder, &[&long[..], options].concat(), signal);
            assert_eq!(code, Some(130), "{options:?}: {said}");
            assert_eq!(said.lines().last(), Some("stopped before the end; nothing was written"));
            assert_eq!(files().collect::<Vec<_>>(), Vec::<OsString>::new(), "{options:?}");
        }
    }
    // The commands are interrupted while they write logs.
    fs::write(folder.join("out/far.waypoints"), FAR).unwrap();
    for flight in [&["fly", "hover", "--controller", "pid", "--duration", "300"][..], &["fly", "out/far.waypoints"]] {
        let arguments = [flight, &logs[..]].concat();
        for _ in 0..2 {
            let mut child = command(&folder, &arguments).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
            let is_begun = || fs::metadata(folder.join("flight.log")).is_ok_and(|it| it.len() > 0);
            while !is_begun() {
                assert_eq!(child.try_wait().unwrap(), None, "{arguments:?}");
                std::thread::sleep(std::time::Duration::from_millis(1));
            }
            assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
            let output = child.wait_with_output().unwrap();
            let said = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.code(), Some(130), "{arguments:?}: {said}");
            assert_eq!(said.lines().last(), Some("stopped before the end; nothing was written"));
            assert_eq!(files().collect::<Vec<_>>(), Vec::<OsString>::new(), "{arguments:?}");
        }
    }
}

/// Empty logs of a command that fails after creating them are removed too.
#[test]
fn an_empty_log_of_a_command_that_fails_is_removed() {
    let folder = folder("failed");
    // Nobody, not even root, can write to this folder.
    let arguments = ["fly", "hover", "--duration", "1", "--exact-log", "flight.log", "--ulog", "/proc/flight.ulg"];
    let output = command(&folder, &arguments).output().unwrap();
    assert_eq!(output.status.code(), Some(2), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(!folder.join("flight.log").exists());
}

//! Completions and the manual.
#![allow(clippy::unwrap_used, reason = "tests")]

mod common;

use common::{folder, sitl};
use std::fs;

#[test]
fn completions_know_every_command_in_every_shell() {
    let folder = folder("completions");
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let output = sitl(&folder, &["completions", shell]);
        let script = String::from_utf8(output.stdout).unwrap();
        for command in ["paper", "fly", "campaign", "compare", "tune", "serve", "bring-up", "man"] {
            assert!(script.contains(command), "{shell} lacks {command}");
        }
    }
}

#[test]
fn the_manual_has_a_page_for_every_command() {
    let folder = folder("manual");
    assert!(sitl(&folder, &["man", "."]).status.success());
    for page in ["sitl.1", "sitl-fly.1", "sitl-compare.1", "sitl-bring-up.1"] {
        let text = fs::read_to_string(folder.join(page)).unwrap();
        assert!(text.contains(".SH NAME") && text.contains(".SH SYNOPSIS"), "{page}");
    }
    let output = sitl(&folder, &["man", "none"]);
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(String::from_utf8(output.stderr).unwrap(), "none: no such folder; name a folder\n");
}

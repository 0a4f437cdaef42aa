//! Tests completions and the manual.
#![allow(clippy::unwrap_used, reason = "tests")]

use crate::common::{command, folder, sitl};
use std::fs;
use std::path::Path;
use std::process::Command;

/// Returns the completions that a shell gets for the last of `words`.
fn completed(test: &str, words: &[&str]) -> Vec<String> {
    let folder = folder(test);
    fs::write(folder.join("mine.toml"), "").unwrap();
    let output = command(&folder, &[&["--"], words].concat())
        .env("COMPLETE", "bash")
        .env("_CLAP_COMPLETE_INDEX", (words.len() - 1).to_string())
        .env("_CLAP_IFS", "\n")
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap().lines().map(str::to_owned).collect()
}

#[test]
fn commands_options_and_names_are_completed() {
    for (words, expected) in [
        (&["sitl", "co"][..], &["compare", "completions"][..]),
        (&["sitl", "fly", "--dur"], &["--duration"]),
        (&["sitl", "fly", "ci"], &["circle"]),
        (&["sitl", "fly", "mi"], &["mine.toml"]),
        (&["sitl", "fly", "hover", "--controller", "af"], &["afbc", "afbc-as-printed"]),
        (&["sitl", "compare", "hover", "--controllers", "pid,ind"], &["pid,indi"]),
        (&["sitl", "compare", "--suite", "f"], &["field", "faults"]),
        (&["sitl", "fly", "hover", "--vehicle", "hum"], &["hummingbird"]),
        (&["sitl", "campaign", "rob"], &["robustness"]),
        (&["sitl", "tune", "ge"], &["geometric"]),
        (&["sitl", "vehicles", "cr"], &["crazyflie"]),
        (&["sitl", "check", "sto"], &["storm"]),
    ] {
        let offered = completed("completed", words);
        for name in expected {
            assert!(offered.iter().any(|other| other == name), "{words:?}: {offered:?}");
        }
        // The list must be short to be of use.
        assert!(offered.len() <= expected.len() + 1, "{words:?}: {offered:?}");
    }
}

/// The script makes bash ask the program for completions.
#[test]
fn the_script_completes_in_bash() {
    let folder = folder("bash");
    let output = sitl(&folder, &["completions", "bash"]);
    fs::write(folder.join("script"), output.stdout).unwrap();
    let ask = "source ./script; COMP_WORDS=(sitl fly ci); COMP_CWORD=2; COMP_TYPE=9; \
               _clap_complete_sitl sitl ci fly; echo \"${COMPREPLY[@]}\"";
    let program = Path::new(env!("CARGO_BIN_EXE_sitl")).parent().unwrap();
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap());
    let output = Command::new("bash").args(["-c", ask]).env("PATH", path).current_dir(&folder).output().unwrap();
    assert_eq!(String::from_utf8(output.stdout).unwrap(), "circle\n", "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn every_shell_has_a_script() {
    let folder = folder("completions");
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let output = sitl(&folder, &["completions", shell]);
        let script = String::from_utf8(output.stdout).unwrap();
        assert!(script.contains("COMPLETE") && script.contains("sitl"), "{shell}: {script}");
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

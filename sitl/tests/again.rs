//! `sitl again`: results made again from their manifest.

#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

use crate::common::{refused, succeeds};
use crate::compare::{SOFT, SUITE, json, sitl, sitl_on, soft};
use afbc_files::seal;
use std::fs;
use std::io::Write as _;
use std::path::Path;

/// Changes the command of a manifest and seals it again, as anyone who can write the file could.
fn forged(manifest: &Path, command: &[&str]) {
    let mut text = fs::read_to_string(manifest).unwrap();
    let (from, to) = (text.find("\"command\": [").unwrap(), text.find("\"fingerprint\"").unwrap());
    text.replace_range(from..to, &format!("\"command\": {}, ", serde_json::json!(command)));
    let digits = text.rfind("xxh64:").unwrap();
    text.replace_range(digits..digits + seal::OPEN.len(), seal::OPEN);
    let mut bytes = Vec::new();
    let mut sealing = seal::SealingWriter::new(&mut bytes);
    sealing.write_all(text.as_bytes()).unwrap();
    sealing.finish().unwrap();
    fs::write(manifest, bytes).unwrap();
}

/// A manifest may come from somebody else, and its seal is no signature. Its command must not write outside its
/// results.
#[test]
fn a_manifest_of_others_writes_nothing_but_its_results() {
    let folder = soft("foreign");
    succeeds(&sitl(&folder, &["fly", "soft.toml", "--controller", "soft", "--out", "theirs"]));
    let manifest = folder.join("theirs/manifest.json");
    fs::write(folder.join("mine"), "mine").unwrap();
    fs::write(folder.join("page.md"), "<!-- suite faults: begin -->\n<!-- suite faults: end -->\n").unwrap();
    for command in [
        &["fly", "soft.toml", "--exact-log", "mine"][..],
        &["fly", "soft.toml", "--exact-log=new"],
        &["fly", "--ulog", "new", "soft.toml"],
        &["fly", "soft.toml", "--mcap", "new"],
        &["fly", "soft.toml", "--force"],
        &["fly", "soft.toml", "--json"],
        &["fly", "soft.toml", "--out", "new"],
        &["--out", "new"],
        &["paper", "--force"],
        &["compare", "--suite", "faults", "--seeds", "1", "--write", "page.md"],
        &["compare", "soft.toml", "--table", "latex"],
        &["campaign", "robustness", "--threads", "1"],
        &["tune", "pid", "--out", "mine"],
        &["merge", "theirs", "-o", "new"],
        &["man", "."],
        &["again", "theirs"],
        &["serve", "--exact-log", "mine"],
        &["fly", "--help"],
        &["fly", "--no-such"],
        &[],
        &["--", "fly"],
    ] {
        forged(&manifest, command);
        if command.is_empty() {
            // An empty command flies the paper's experiment, which differs from these results.
            assert_eq!(sitl(&folder, &["again", "theirs"]).status.code(), Some(1));
            fs::remove_dir_all(folder.join("theirs-again")).unwrap();
            continue;
        }
        let line = refused(&sitl(&folder, &["again", "theirs"]));
        assert!(
            line.starts_with("theirs: the manifest's command ") && line.lines().count() == 1,
            "{command:?}: {line}"
        );
        let mut names: Vec<_> = fs::read_dir(&folder).unwrap().map(|it| it.unwrap().file_name()).collect();
        names.sort();
        assert_eq!(names, ["mine", "page.md", "soft.toml", "theirs"], "{command:?}");
        assert_eq!(fs::read(folder.join("mine")).unwrap(), b"mine");
    }
    // A folder with other content is not written to, and a manifest cannot name a file by a path.
    forged(&manifest, &["fly", "soft.toml", "--controller", "soft"]);
    fs::create_dir(folder.join("other")).unwrap();
    fs::write(folder.join("other/report.html"), "mine").unwrap();
    refused(&sitl(&folder, &["again", "theirs", "--out", "other"]));
    assert_eq!(fs::read(folder.join("other/report.html")).unwrap(), b"mine");
    let path = fs::read_to_string(&manifest).unwrap().replace("\"report.html\": \"xxh64:", "\"../mine\": \"xxh64:");
    fs::write(&manifest, path).unwrap();
    forged(&manifest, &["fly", "soft.toml", "--controller", "soft"]);
    let line = refused(&sitl(&folder, &["again", "theirs"]));
    assert!(line.contains("damaged or no manifest (a path in it, ../mine)"), "{line}");
}

/// Repeats a campaign, one of its parts, and the merged whole. A folder that has results already is refused.
#[test]
fn campaigns_are_made_again() {
    let folder = soft("campaigns");
    let text = "flights = 5\nscenario = \"soft.toml\"\n[spread]\nmass_ratio = [0.9, 1.1]\n";
    fs::write(folder.join("few.toml"), text).unwrap();
    fs::write(folder.join("soft.toml"), SOFT.replace("duration_s = 8.0", "duration_s = 1.0")).unwrap();
    let on = ["campaign", "few.toml", "--vehicle", "racer"];
    succeeds(&sitl(&folder, &[&on[..], &["--threads", "1", "--json"]].concat()));
    for part in ["1/2", "2/2"] {
        succeeds(&sitl(&folder, &[&on[..], &["--shard", part]].concat()));
    }
    succeeds(&sitl(&folder, &["merge", "out/few-1-of-2", "out/few-2-of-2", "-o", "out/whole"]));
    for name in ["few", "few-2-of-2", "whole"] {
        let said = succeeds(&sitl(&folder, &["again", &format!("out/{name}")]));
        assert!(said.starts_with("the same bytes: ") && said.contains(&format!("out/{name}-again")), "{said}");
        let line = refused(&sitl(&folder, &["again", &format!("out/{name}/manifest.json")]));
        assert!(line.starts_with(&format!("out/{name}-again: the folder exists already; ")), "{line}");
    }
    let commands =
        ["few", "whole"].map(|name| json(&folder.join(format!("out/{name}/manifest.json")))["command"].clone());
    assert_eq!(commands, [serde_json::json!(on), serde_json::json!(on)]);
    fs::write(folder.join("few.toml"), text.replace("1.1", "1.2")).unwrap();
    let output = sitl(&folder, &["again", "out/few", "--out", "other"]);
    let said = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("results.parquet: differs\n") && said.contains("the inputs differ"), "{said}");
}

/// Repeating a manifest gives the same bytes; differences are reported.
#[test]
fn a_manifest_makes_the_same_results_again() {
    let folder = soft("again");
    fs::write(folder.join("two.toml"), SUITE).unwrap();
    for (name, command) in [
        ("compare", &["compare", "soft.toml", "--controllers", "pid,soft", "--seeds", "2"][..]),
        ("suite", &["compare", "--suite", "two.toml", "--controllers", "pid", "--seeds", "1"]),
        ("random", &["compare", "--suite", "random", "--vehicle", "iris", "--flights", "1", "--controllers", "pid"]),
        ("round", &["fly", "soft.toml", "--controller", "soft"]),
    ] {
        succeeds(&sitl(&folder, &[command, &["--out", &format!("mine/{name}"), "--force"]].concat()));
        let manifest = format!("mine/{name}/manifest.json");
        let written = json(&folder.join(&manifest));
        assert_eq!(written["command"], serde_json::json!(command));
        let flown = &written["flown"][0];
        assert!(!flown["seeds"].as_array().unwrap().is_empty());
        assert!(flown["scenario"]["contenders"][0]["law"].is_object(), "{flown}");
        assert!(written["machine"]["cores"].as_u64().unwrap() > 0);
        let said = succeeds(&sitl_on("1", &folder, &["again", &manifest]));
        assert!(said.starts_with("the same bytes: "), "{said}");
        assert!(folder.join(format!("mine/{name}-again/report.html")).exists());
    }
    // Other gains change the flight, and the reason is reported.
    fs::write(folder.join("soft.toml"), SOFT.replace("climb_p_1_s = 1.5", "climb_p_1_s = 1.6")).unwrap();
    let output = sitl(&folder, &["again", "mine/round", "--out", "other"]);
    let said = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("round-soft.csv: differs\n") && said.contains("the inputs differ"), "{said}");
    // `again` refuses a modified manifest and a missing one.
    let path = folder.join("mine/round/manifest.json");
    fs::write(&path, fs::read_to_string(&path).unwrap().replace("\"soft.toml\"", "\"hover\"")).unwrap();
    let line = refused(&sitl(&folder, &["again", "mine/round"]));
    assert!(
        line.starts_with("mine/round/manifest.json: the file is damaged or no manifest (the file's checksum is wrong)"),
        "{line}"
    );
    let line = refused(&sitl(&folder, &["again", "nowhere.json"]));
    assert!(line.starts_with("nowhere.json: cannot be read") && line.lines().count() == 1, "{line}");
}

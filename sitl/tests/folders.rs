//! Tests ownership of output folders: no command removes or replaces files that it has not written.

#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

use crate::common::sitl;
use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

/// Returns a folder for a test, with a scenario, a campaign, its parts and a log.
fn folder(test: &str) -> PathBuf {
    let folder = crate::common::folder(test);
    let hover = "[trajectory]\nkind = \"hover\"\nposition_m = [0, 0, 1]\n";
    fs::write(folder.join("short.toml"), format!("duration_s = 0.5\n{hover}")).unwrap();
    fs::write(folder.join("few.toml"), "flights = 3\nduration_s = 0.5\nscenario = \"short.toml\"\n").unwrap();
    crate::common::log_at_rest(&folder, 3);
    let shards = [["campaign", "few.toml", "--shard", "1/2"], ["campaign", "few.toml", "--shard", "2/2"]];
    for (shard, out) in shards.iter().zip(["part-1", "part-2"]) {
        assert_eq!(sitl(&folder, &[&shard[..], &["--out", out]].concat()).status.code(), Some(0));
    }
    folder
}

/// Every command with an output folder, and the command recorded as the folder's owner.
const COMMANDS: [(&str, &[&str]); 7] = [
    ("paper", &["paper", "--duration", "0.5"]),
    ("fly", &["fly", "short.toml"]),
    ("compare", &["compare", "short.toml"]),
    ("replay", &["replay", "rest.csv"]),
    ("campaign", &["campaign", "few.toml"]),
    ("campaign --flight", &["campaign", "few.toml", "--flight", "1"]),
    ("campaign", &["merge", "part-1", "part-2"]),
];

/// Returns the content of a folder: files with their bytes, links with their targets, and folders.
fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let kind = fs::symlink_metadata(&path).unwrap().file_type();
        if kind.is_symlink() {
            found.insert(path.clone(), fs::read_link(&path).unwrap().into_os_string().into_encoded_bytes());
        } else if kind.is_dir() {
            found.extend(contents(&path));
            found.insert(path, Vec::new());
        } else {
            found.insert(path.clone(), fs::read(&path).unwrap());
        }
    }
    found
}

/// Checks for a one-line error that names the folder and the remedies, and that nothing has changed.
fn refused(folder: &Path, command: &[&str], out: &str, before: &BTreeMap<PathBuf, Vec<u8>>) {
    let output = sitl(folder, &[command, &["--out", out]].concat());
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{command:?}: {error}");
    assert_eq!(error.lines().count(), 1, "{command:?}: {error}");
    assert!(error.starts_with(out) && error.contains("--out") && error.contains("--force"), "{command:?}: {error}");
    assert_eq!(&contents(&folder.join(out)), before, "{command:?}");
}

fn succeeds(folder: &Path, command: &[&str], more: &[&str]) {
    let output = sitl(folder, &[command, more].concat());
    assert_eq!(output.status.code(), Some(0), "{command:?}: {}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn a_folder_of_one_command_is_refused_by_every_other() {
    let folder = folder("pairs");
    for (number, (owner, command)) in COMMANDS.iter().enumerate() {
        let out = format!("own-{number}");
        let path = folder.join(&out);
        // An empty folder can be used by any command.
        fs::create_dir(&path).unwrap();
        succeeds(&folder, command, &["--out", &out]);
        // Files of others are never touched.
        fs::create_dir(path.join("mine")).unwrap();
        for name in ["notes.csv", "mine/figure.svg", "zzz.parquet"] {
            fs::write(path.join(name), name).unwrap();
        }
        succeeds(&folder, command, &["--out", &out]);
        let before = contents(&path);
        for (_, other) in COMMANDS.iter().filter(|(other, _)| other != owner) {
            refused(&folder, other, &out, &before);
        }
        // With --force, the folder becomes another command's.
        let (_, other) = COMMANDS.iter().find(|(other, _)| other != owner).unwrap();
        succeeds(&folder, other, &["--out", &out, "--force"]);
        refused(&folder, command, &out, &contents(&path));
        succeeds(&folder, command, &["--out", &out, "--force"]);
        let after = contents(&path);
        for name in ["notes.csv", "mine/figure.svg", "zzz.parquet"] {
            assert_eq!(after[&path.join(name)], name.as_bytes(), "{owner}");
        }
    }
}

/// Function that puts a foreign file into a folder.
type Make<'a> = &'a dyn Fn(&Path);

#[test]
fn a_foreign_folder_is_refused_by_all_commands() {
    let folder = folder("foreign");
    let make: [(&str, Make); 8] = [
        ("notes", &|path| fs::write(path.join("notes.txt"), "mine").unwrap()),
        ("chunks", &|path| {
            fs::create_dir(path.join("chunks")).unwrap();
            fs::write(path.join("chunks/000000.parquet"), "mine").unwrap();
        }),
        ("empty-chunks", &|path| fs::create_dir(path.join("chunks")).unwrap()),
        ("results", &|path| fs::write(path.join("results.parquet"), "mine").unwrap()),
        ("report", &|path| fs::write(path.join("report.html"), "mine").unwrap()),
        ("manifest", &|path| fs::write(path.join("campaign.json"), "{}").unwrap()),
        ("marker", &|path| {
            let text = r#"{"command":"fly","name":"a","files":["../short.toml"],"checksum":"xxh64:0000000000000000"}"#;
            fs::write(path.join(".sitl.json"), text).unwrap();
        }),
        ("link", &|path| symlink("../short.toml", path.join("report.html")).unwrap()),
    ];
    for (out, make) in make {
        let path = folder.join(out);
        fs::create_dir(&path).unwrap();
        make(&path);
        let before = contents(&path);
        for (_, command) in COMMANDS {
            refused(&folder, command, out, &before);
        }
    }
    let scenario = fs::read(folder.join("short.toml")).unwrap();
    // A link to a foreign folder is refused too. --force replaces a link inside the folder, not the link's target.
    symlink("notes", folder.join("linked")).unwrap();
    for (_, command) in COMMANDS {
        refused(&folder, command, "linked", &contents(&folder.join("linked")));
        succeeds(&folder, command, &["--out", "link", "--force"]);
        succeeds(&folder, command, &["--out", "chunks", "--force"]);
    }
    assert!(fs::symlink_metadata(folder.join("link/report.html")).unwrap().is_file());
    assert_eq!(fs::read(folder.join("short.toml")).unwrap(), scenario);
}

#[test]
fn a_part_is_not_merged_into_itself() {
    let folder = folder("itself");
    let before = contents(&folder.join("part-1"));
    for more in [&["--out", "part-1"][..], &["--out", "./part-1", "--force"]] {
        let output = sitl(&folder, &[&["merge", "part-1", "part-2"], more].concat());
        let error = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{error}");
        assert!(error.starts_with("part-1: the folder is one of the parts; "), "{error}");
        assert_eq!(contents(&folder.join("part-1")), before);
    }
}

#[test]
fn files_of_an_earlier_report_are_removed() {
    let folder = folder("stale");
    let csvs = |out: &str| {
        let names =
            fs::read_dir(folder.join(out)).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
        let mut csvs: Vec<_> = names.filter(|name| name.ends_with(".csv")).collect();
        csvs.sort();
        csvs
    };
    // Other options count as another command, whose results replace the former ones only with --force.
    let fly = ["fly", "short.toml", "--out", "fly"];
    succeeds(&folder, &fly, &[]);
    succeeds(&folder, &fly, &["--controller", "pid", "--force"]);
    assert_eq!(csvs("fly"), ["short-pid.csv"]);
    let paper = ["paper", "--duration", "0.5", "--log-hz", "1", "--out", "paper"];
    succeeds(&folder, &paper, &["--reading", "all"]);
    assert_eq!(csvs("paper").len(), 6);
    succeeds(&folder, &paper, &["--force"]);
    assert_eq!(csvs("paper"), ["paper-afbc.csv", "paper-backstepping.csv"]);
    // With two scenarios, each has figures under its own name.
    let longer = fs::read_to_string(folder.join("short.toml")).unwrap().replace("0.5", "0.6");
    fs::write(folder.join("longer.toml"), longer).unwrap();
    let names = |more: &[&str]| {
        succeeds(&folder, &["compare", "short.toml", "--out", "compare", "--force"], more);
        contents(&folder.join("compare")).into_keys().collect::<Vec<_>>()
    };
    let one = names(&[]);
    assert!(names(&["longer.toml"]).len() > one.len());
    assert_eq!(names(&[]), one);
}

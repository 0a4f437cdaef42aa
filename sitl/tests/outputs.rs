//! Tests output files: no command replaces a file unasked, and a refused command leaves no file behind.

#![expect(clippy::unwrap_used, reason = "tests")]

use crate::common::{command, folder, log_at_rest, refused, sitl, succeeds};
use std::fs;
use std::net::UdpSocket;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

/// Returns a folder with the files that the commands below read.
fn prepared(test: &str) -> PathBuf {
    let folder = folder(test);
    let hover = "[trajectory]\nkind = \"hover\"\nposition_m = [0, 0, 1]\n";
    fs::write(folder.join("short.toml"), format!("duration_s = 0.5\n{hover}")).unwrap();
    let snap = "duration_s = 9\n[trajectory]\nkind = \"minimum-snap\"\nspeed_max_m_s = 1\nacceleration_max_m_s2 = 1\n";
    let waypoints =
        "[[trajectory.waypoint]]\nposition_m = [0, 0, 1]\n[[trajectory.waypoint]]\nposition_m = [1, 0, 1]\n";
    fs::write(folder.join("snap.toml"), format!("{snap}{waypoints}")).unwrap();
    fs::write(folder.join("log.csv"), "time_s,x_m\n0,1\n1,2\n").unwrap();
    let mission = "QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t47.4\t8.5\t488\t1\n1\t0\t3\t22\t0\t0\t0\t0\t47.4\t8.5\t5\t1\n\
                   2\t0\t3\t21\t0\t0\t0\t0\t47.4\t8.5\t0\t1\n";
    fs::write(folder.join("mission.txt"), mission).unwrap();
    log_at_rest(&folder, 3);
    let log = ["fly", "mocap", "--controller", "pid", "--duration", "0.5", "--ulog", "a.ulg", "--out", "log"];
    succeeds(&sitl(&folder, &log));
    folder
}

/// Commands whose last option names a file to write, and whether they have `--force`.
const COMMANDS: [(&[&str], bool); 17] = [
    (&["tune", "pid", "--scenario", "short.toml", "--budget", "1", "--out"], true),
    (&["params", "export", "--out"], true),
    (&["params", "export", "--format", "mavproxy", "-o"], true),
    (&["check", "snap.toml", "--polynomials"], true),
    (&["plot", "log.csv", "--y", "x_m", "--out"], true),
    (&["mcap", "a.ulg", "--out"], false),
    (&["fly", "mocap", "--controller", "pid", "--duration", "0.5", "--exact-log"], false),
    (&["fly", "mocap", "--controller", "pid", "--duration", "0.5", "--ulog"], false),
    (&["fly", "mocap", "--controller", "pid", "--duration", "0.5", "--mcap"], false),
    (&["fly", "mission.txt", "--duration", "1", "--exact-log"], false),
    (&["fly", "mission.txt", "--duration", "1", "--ulog"], false),
    (&["fly", "mission.txt", "--duration", "1", "--mcap"], false),
    (&["serve", "--port", "0", "--station", "none", "--fast", "--do", "at 1 quit", "--exact-log"], false),
    (&["serve", "--port", "0", "--station", "none", "--fast", "--do", "at 1 quit", "--ulog"], false),
    (&["pil", "hover", "--image", "nothing", "--out"], false),
    (&["hitl", "hover", "--port", "./nothing", "--out"], false),
    (&["bring-up", "--yes", "--connect", "serial:./nothing", "--out"], false),
];

/// Name of the file; its extension is one that `plot` accepts.
const FILE: &str = "out.svg";

#[test]
fn nothing_that_is_there_is_replaced_unasked() {
    let folder = prepared("kept");
    let path = folder.join(FILE);
    for (command, forcible) in COMMANDS {
        for kind in ["file", "empty", "link", "lost"] {
            match kind {
                "file" => fs::write(&path, "mine").unwrap(),
                "empty" => fs::write(&path, "").unwrap(),
                "link" => symlink("log.csv", &path).unwrap(),
                _ => symlink("nowhere", &path).unwrap(),
            }
            let before = (fs::symlink_metadata(&path).unwrap().file_type(), fs::read(&path).ok());
            let error = refused(&sitl(&folder, &[command, &[FILE]].concat()));
            assert_eq!(error.lines().count(), 1, "{command:?}: {error}");
            let cure = if forcible { "--force" } else { "remove that one" };
            assert!(
                error.starts_with(&format!("{FILE}: the file exists already; ")) && error.contains(cure),
                "{error}"
            );
            assert_eq!((fs::symlink_metadata(&path).unwrap().file_type(), fs::read(&path).ok()), before, "{command:?}");
            assert!(!folder.join("nowhere").exists() && !folder.join("out").exists(), "{command:?}");
            fs::remove_file(&path).unwrap();
        }
        if forcible {
            fs::write(&path, "mine").unwrap();
            succeeds(&sitl(&folder, &[command, &[FILE, "--force"]].concat()));
            assert_ne!(fs::read(&path).unwrap(), b"mine", "{command:?}");
            fs::remove_file(&path).unwrap();
        }
        let error = refused(&sitl(&folder, &[command, &["no/such/out.svg"]].concat()));
        assert!(error.starts_with("no/such/out.svg: ") && error.lines().count() == 1, "{command:?}: {error}");
    }
}

/// A refused command leaves no file, whatever the mistake is.
#[test]
fn a_command_that_is_refused_leaves_no_file() {
    let folder = prepared("refused");
    let before = fs::read_dir(&folder).unwrap().count();
    fs::create_dir(folder.join("taken")).unwrap();
    fs::write(folder.join("taken/notes.txt"), "mine").unwrap();
    let taken = UdpSocket::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    let fly = ["fly", "mocap", "--controller", "pid", "--duration", "0.5", "--out", "taken"];
    for log in ["--exact-log", "--ulog", "--mcap"] {
        refused(&sitl(&folder, &[&fly[..], &[log, FILE]].concat()));
        refused(&sitl(&folder, &["fly", "mission.txt", log, FILE, "--vehicle", "nothing.toml"]));
    }
    for log in ["--exact-log", "--ulog"] {
        let serve = ["serve", "--station", "none", "--companion", "none", log, FILE];
        refused(&sitl(&folder, &[&serve[..], &["--port", &port]].concat()));
        refused(&sitl(&folder, &[&serve[..], &["--port", "0", "--do", "nonsense"]].concat()));
        refused(&sitl(&folder, &[&serve[..], &["--port", "0", "--station", "nowhere:what"]].concat()));
    }
    refused(&sitl(&folder, &["mcap", "log.csv", "--out", FILE]));
    for (command, _) in COMMANDS.into_iter().filter(|(command, _)| command.iter().any(|word| word.contains("nothing")))
    {
        let output = sitl(&folder, &[command, &[FILE]].concat());
        assert!(!output.status.success(), "{command:?}");
    }
    assert_eq!(fs::read_dir(&folder).unwrap().count(), before + 1);
}

#[test]
fn pages_of_the_manual_are_replaced_by_force_alone() {
    let folder = folder("manual");
    fs::write(folder.join("sitl-fly.1"), "mine").unwrap();
    let error = refused(&sitl(&folder, &["man", "."]));
    assert!(error.contains("sitl-fly.1: the file exists already") && error.contains("--force"), "{error}");
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
    succeeds(&sitl(&folder, &["man", ".", "--force"]));
    assert_ne!(fs::read(folder.join("sitl-fly.1")).unwrap(), b"mine");
}

/// Tests the same command again, with other options, and twice at once.
#[test]
fn results_of_another_command_line_are_kept() {
    let folder = prepared("lines");
    let all = |folder: &Path| -> Vec<(PathBuf, Vec<u8>)> {
        let paths = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        let mut all: Vec<_> = paths.map(|path| (path.clone(), fs::read(path).unwrap())).collect();
        all.sort();
        all
    };
    for (name, first, same, other) in [
        ("paper", &["paper", "--duration", "1"][..], &["--duration", "1", "--json"][..], &["--duration", "1.5"][..]),
        ("paper", &["--force"], &["paper"], &["paper", "--reading", "none"]),
        ("short", &["fly", "short.toml"], &["fly", "short.toml", "--json"], &["fly", "short.toml", "--log-hz", "50"]),
        (
            "compare",
            &["compare", "short.toml", "--controllers", "pid"],
            &["compare", "short.toml", "--controllers", "pid", "--table", "latex"],
            &["compare", "short.toml", "--controllers", "indi"],
        ),
        (
            "replay-rest",
            &["replay", "rest.csv"],
            &["replay", "rest.csv", "--json"],
            &["replay", "rest.csv", "--from", "0.5"],
        ),
    ] {
        succeeds(&sitl(&folder, first));
        succeeds(&sitl(&folder, same));
        let out = folder.join("out").join(name);
        let before = all(&out);
        let error = refused(&sitl(&folder, other));
        assert!(error.contains("--out") && error.contains("--force") && error.lines().count() == 1, "{error}");
        assert_eq!(all(&out), before, "{other:?}");
        // A modified file is kept, even for the same command.
        fs::write(out.join("report.html"), "mine").unwrap();
        let error = refused(&sitl(&folder, same));
        assert!(error.contains("report.html: the file was changed after"), "{error}");
        assert_eq!(fs::read(out.join("report.html")).unwrap(), b"mine");
        succeeds(&sitl(&folder, &[same, &["--force"]].concat()));
    }
    let long = ["fly", "hover", "--controller", "pid", "--duration", "300"];
    let children: Vec<_> = (0..2)
        .map(|_| command(&folder, &long).stderr(std::process::Stdio::piped()).spawn().unwrap())
        .map(|child| std::thread::spawn(|| child.wait_with_output().unwrap()))
        .collect();
    let ends: Vec<_> = children.into_iter().map(|child| child.join().unwrap()).collect();
    for end in ends.iter().filter(|end| !end.status.success()) {
        let error = String::from_utf8_lossy(&end.stderr);
        assert!(error.contains("out/hover: another program is writing into this folder"), "{error}");
    }
    assert!(ends.iter().any(|end| end.status.success()));
    succeeds(&sitl(&folder, &["again", "out/hover"]));
}

/// Only `afbc-files` may create result files.
#[test]
fn no_other_code_creates_files() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let mut folders = vec![root.join("sitl/src")];
    let crates = ["campaign", "ground", "hil", "plot", "replay", "report", "serve", "tune"];
    folders.extend(crates.map(|name| root.join("crates").join(name).join("src")));
    let mut found = Vec::new();
    while let Some(folder) = folders.pop() {
        for path in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|it| it == "rs") && path.file_stem().is_some_and(|it| it != "tests")
            {
                // This call creates logs through `afbc-files`.
                let text = fs::read_to_string(&path).unwrap().replace("LogFile::create(", "");
                let creates =
                    ["fs::write(", "File::create", ".create(true)", ".create_new(true)", "from_path(", "generate_to("];
                found.extend(creates.iter().filter(|it| text.contains(*it)).map(|it| (path.clone(), *it)));
            }
        }
    }
    assert!(found.is_empty(), "{found:?}");
}

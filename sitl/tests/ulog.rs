//! Tests `--ulog` of `sitl fly` and `sitl serve`: files, errors and a full disc.

#![expect(clippy::unwrap_used, reason = "tests")]

use crate::common::{folder, refused, sitl, succeeds};
use std::fs;
use std::path::Path;

/// Serves at free ports, and sends nothing to anyone.
const SERVE: [&str; 8] = ["serve", "--port", "0", "--station", "none", "--companion", "none", "--fast"];

/// Plan that takes off and holds.
#[cfg(unix)]
const PLAN: &str = r#"{"fileType": "Plan", "version": 1, "groundStation": "QGroundControl",
    "geoFence": {"circles": [], "polygons": [], "version": 2}, "rallyPoints": {"points": [], "version": 2},
    "mission": {"version": 2, "firmwareType": 12, "vehicleType": 2, "cruiseSpeed": 15, "hoverSpeed": 5,
    "plannedHomePosition": [47.397742, 8.545594, 488], "globalPlanAltitudeMode": 1, "items": [
    {"type": "SimpleItem", "command": 22, "frame": 3, "autoContinue": true, "doJumpId": 1,
    "params": [0, 0, 0, null, 47.397742, 8.545594, 10]},
    {"type": "SimpleItem", "command": 16, "frame": 3, "autoContinue": true, "doJumpId": 2,
    "params": [600, 0, 0, null, 47.397742, 8.545594, 10]}]}}"#;

fn is_log(path: &Path) -> bool {
    fs::read(path).is_ok_and(|bytes| bytes.starts_with(b"ULog\x01\x12\x35\x01") && bytes.len() > 50_000)
}

#[test]
fn a_flight_is_logged_and_replayed() {
    let folder = folder("flown");
    let fly = ["fly", "mocap", "--controller", "pid", "--duration", "1", "--ulog", "flight.ulg"];
    let output = sitl(&folder, &fly);
    succeeds(&output);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("flight.ulg: ULog of the firmware's code under pid"), "{said}");
    assert!(is_log(&folder.join("flight.ulg")));
    let said = succeeds(&sitl(&folder, &["replay", "flight.ulg"]));
    assert!(said.contains("ULog of this firmware") && said.contains("tracker (afbc_aid)"), "{said}");
    // An existing log is not overwritten, and nothing is flown if the log cannot be created.
    let out = folder.join("out");
    fs::remove_dir_all(&out).unwrap();
    for (path, cure) in [("flight.ulg", "remove that one"), ("no/such/folder.ulg", "choose another file for --ulog")] {
        let said = refused(&sitl(&folder, &["fly", "mocap", "--duration", "1", "--ulog", path]));
        assert!(said.starts_with(&format!("{path}: ")) && said.contains(cure) && said.lines().count() == 1, "{said}");
    }
    assert!(!out.exists());
}

#[test]
fn served_vehicles_have_a_log_each() {
    let folder = folder("served");
    succeeds(&sitl(&folder, &[&SERVE[..], &["--ulog", "one.ulg", "--do", "at 2 quit"]].concat()));
    assert!(is_log(&folder.join("one.ulg")));
    let two = ["--vehicles", "2", "--system", "7", "--ulog", "two.ulg", "--do", "at 2 quit"];
    succeeds(&sitl(&folder, &[&SERVE[..], &two].concat()));
    assert!(is_log(&folder.join("two.7.ulg")) && is_log(&folder.join("two.8.ulg")) && !folder.join("two.ulg").exists());
    let again = [&SERVE[..], &["--ulog", "one.ulg", "--do", "at 2 quit"]].concat();
    let said = refused(&sitl(&folder, &again));
    assert!(said.starts_with("one.ulg: the file exists already") && said.lines().count() == 1, "{said}");
}

/// In a folder, each start writes the next file; with several vehicles, each has a folder of its own.
#[test]
fn a_folder_gathers_the_logs() {
    let folder = folder("gathered");
    let logs = folder.join("logs");
    fs::create_dir(&logs).unwrap();
    fs::write(logs.join("log007.ulg"), b"an older one").unwrap();
    let serve = [&SERVE[..], &["--ulog", "logs", "--do", "at 1 quit"]].concat();
    (0..2).for_each(|_| drop(succeeds(&sitl(&folder, &serve))));
    assert!(is_log(&logs.join("log008.ulg")) && is_log(&logs.join("log009.ulg")));
    assert_eq!(fs::read(logs.join("log007.ulg")).unwrap(), b"an older one");
    succeeds(&sitl(&folder, &[&serve[..], &["--vehicles", "2"]].concat()));
    assert!(is_log(&logs.join("1/log001.ulg")) && is_log(&logs.join("2/log001.ulg")));
}

/// If a file cannot grow, as on a full disc, the log ends but the vehicle flies on. The error is reported once.
#[cfg(unix)]
#[test]
fn a_full_disc_costs_the_log_alone() {
    let folder = folder("full");
    let sitl = env!("CARGO_BIN_EXE_sitl");
    let serve = [&SERVE[..], &["--ulog", "full.ulg", "--do", "'at 6 quit'"]].concat().join(" ");
    let script = format!("trap '' XFSZ; ulimit -f 400; exec {sitl} {serve}");
    let output = std::process::Command::new("sh").current_dir(&folder).args(["-c", &script]).output().unwrap();
    let said = succeeds(&output);
    let told: Vec<_> = said.lines().filter(|line| line.contains("full.ulg: the log ended early")).collect();
    assert!(told.len() == 1 && said.contains("6.000 ok at 6 quit"), "{said}");
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(is_log(&folder.join("full.ulg")));
}

/// A flight whose log is cut short reports it, exits with 2 and keeps its other results.
#[cfg(unix)]
#[test]
fn a_flight_on_a_full_disc_fails() {
    let folder = folder("flown-full");
    let sitl = env!("CARGO_BIN_EXE_sitl");
    fs::write(folder.join("short.plan"), PLAN).unwrap();
    for (fly, kept) in [
        ("fly mocap --controller pid --duration 60 --log-hz 1 --out out --ulog cut.ulg", Some("report.html")),
        ("fly mocap --controller pid --duration 60 --log-hz 1 --out out --exact-log cut.ulg", Some("report.html")),
        ("fly short.plan --duration 60 --ulog cut.ulg", None),
    ] {
        let script = format!("trap '' XFSZ; ulimit -f 2000; exec {sitl} {fly}");
        let output = std::process::Command::new("sh").current_dir(&folder).args(["-c", &script]).output().unwrap();
        let error = String::from_utf8(output.stderr).unwrap();
        let told: Vec<_> =
            error.lines().filter(|line| line.contains("cut.ulg: ") && line.contains("too large")).collect();
        assert_eq!((output.status.code(), told.is_empty()), (Some(2), false), "{fly}: {error}");
        assert!(kept.is_none_or(|file| folder.join("out").join(file).exists()), "{fly}: {error}");
        fs::remove_file(folder.join("cut.ulg")).unwrap();
        let _ = fs::remove_dir_all(folder.join("out"));
    }
}

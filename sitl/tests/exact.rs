//! Tests `sitl replay --exact` on logs of `fly` and `serve`: messages and exit codes.

#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

use crate::common::{folder, log_at_rest, refused, sitl, succeeds};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// Flies the paper's scenario for a second under a law, with an exact log.
fn flown(test: &str, law: &str) -> std::path::PathBuf {
    let folder = folder(test);
    let options = ["fly", "paper", "--controller", law, "--duration", "1", "--exact-log", "flight.log"];
    let output = sitl(&folder, &options);
    succeeds(&output);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains(&format!("flight.log: exact log of the firmware's code under {law}")), "{said}");
    folder
}

#[test]
fn a_flight_is_the_same_again_under_every_law() {
    for law in ["afbc", "pid"] {
        let folder = flown(&format!("flown-{law}"), law);
        let said = succeeds(&sitl(&folder, &["replay", "--exact", "flight.log"]));
        assert!(said.contains(&format!("paper under {law}")) && said.contains("to the last bit"), "{said}");
        assert!(said.contains("no tick lost") && said.contains("armed once"), "{said}");
        assert!(!folder.join("out/replay-flight").exists());
        let found = succeeds(&sitl(&folder, &["replay", "--exact", "flight.log", "--json"]));
        let found: Value = serde_json::from_str(&found).unwrap();
        assert_eq!((&found["is_same"], &found["law"], &found["change"]), (&true.into(), &law.into(), &Value::Null));
    }
}

#[test]
fn a_change_is_shown() {
    let folder = flown("changed", "afbc");
    let said = succeeds(&sitl(&folder, &["replay", "--exact", "flight.log", "--change", "law=pid"]));
    assert!(
        said.contains("the same inputs with law=pid") && said.contains("rotor 4") && said.contains("roll setpoint"),
        "{said}"
    );
    let out = folder.join("out/replay-flight");
    let summary: Value = serde_json::from_slice(&fs::read(out.join("summary.json")).unwrap()).unwrap();
    let differences = summary["change"]["differences"].as_array().unwrap();
    let of = |name: &str| differences.iter().find(|it| it["name"] == name).unwrap()["largest"].as_f64();
    assert!(of("omega1_rad_s").unwrap() > 0.0, "{summary:#}");
    assert!(!said.contains("rotor 5") && !differences.iter().any(|it| it["name"] == "omega5_rad_s"));
    for name in ["motors.svg", "demands.svg"] {
        roxmltree::Document::parse(&fs::read_to_string(out.join(name)).unwrap()).unwrap();
    }
    let csv = fs::read_to_string(out.join("change.csv")).unwrap();
    let columns = csv.lines().next().unwrap().split(',').count();
    // The columns are the time, and 27 values of both versions: four speeds, four throttles and nineteen others.
    assert!(columns == 1 + 2 * 27 && csv.lines().all(|line| line.split(',').count() == columns), "{columns}");
    for (change, wanted) in [("NO_SUCH=1", "no such parameter"), ("V_MASS=-1", "V_MASS: must be")] {
        let said = refused(&sitl(&folder, &["replay", "--exact", "flight.log", "--change", change]));
        assert!(said.contains(wanted) && said.lines().count() == 1, "{said}");
    }
}

/// A damaged log is reported on stderr in one line with its cure, and the exit code is 1.
#[test]
fn a_difference_ends_with_1() {
    let folder = flown("damaged", "afbc");
    let mut log = fs::read(folder.join("flight.log")).unwrap();
    let middle = log.len() / 2;
    log[middle] ^= 4;
    fs::write(folder.join("flight.log"), &log).unwrap();
    let output = sitl(&folder, &["replay", "--exact", "flight.log"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.starts_with("flight.log: byte ") && said.contains("tick ") && said.lines().count() == 1, "{said}");
    assert!(String::from_utf8_lossy(&output.stdout).contains("give the same results again"));
}

#[test]
fn the_two_kinds_of_logs_are_told_apart() {
    let folder = flown("kinds", "afbc");
    log_at_rest(&folder, 2);
    let said = refused(&sitl(&folder, &["replay", "flight.log"]));
    assert!(said.contains("--exact") && said.lines().count() == 1, "{said}");
    for name in ["rest.csv", "none.log", "empty.log"] {
        fs::write(folder.join("empty.log"), "").unwrap();
        let said = refused(&sitl(&folder, &["replay", "--exact", name]));
        assert!(said.starts_with(name) && said.contains(';') && said.lines().count() == 1, "{said}");
    }
    let output = sitl(&folder, &["replay", "rest.csv", "--change", "law=pid"]);
    assert!(!output.status.success() && String::from_utf8_lossy(&output.stderr).contains("--exact"));
}

fn served(folder: &Path, vehicles: &str) {
    let quiet = ["serve", "--port", "0", "--station", "none", "--companion", "none", "--fast", "--do", "at 3 quit"];
    let options = [quiet.as_slice(), &["--vehicles", vehicles, "--exact-log", "served.log"]].concat();
    succeeds(&sitl(folder, &options));
}

#[test]
fn a_served_vehicle_keeps_a_log() {
    let folder = folder("served");
    served(&folder, "1");
    let said = succeeds(&sitl(&folder, &["replay", "--exact", "served.log"]));
    assert!(said.contains("to the last bit") && said.contains("armed 0 times"), "{said}");
    served(&folder, "2");
    for system in 1..=2 {
        let said = succeeds(&sitl(&folder, &["replay", "--exact", &format!("served.log.{system}")]));
        assert!(said.contains("to the last bit"), "{said}");
        let has_id = said.contains(&format!("MAV_SYS_ID = {system}"));
        assert_eq!(has_id, system == 2, "{said}");
    }
    let nowhere = ["serve", "--port", "0", "--exact-log", "no/such/folder.log", "--do", "at 0.1 quit"];
    let said = refused(&sitl(&folder, &nowhere));
    assert!(said.contains("no/such/folder.log") && said.contains("--exact-log"), "{said}");
}

//! Tests output for programs: JSON on stdout with exactly the keys of docs/json.md. Also tests that scenario and
//! campaign files are told apart.

#![expect(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, reason = "tests")]

use crate::common::{folder, sitl};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Returns the output of a successful command.
fn succeeds(folder: &Path, arguments: &[&str]) -> String {
    crate::common::succeeds(&sitl(folder, arguments))
}

/// Returns the one-line error of a refused command.
fn refused(folder: &Path, arguments: &[&str]) -> String {
    let said = crate::common::refused(&sitl(folder, arguments));
    assert_eq!(said.lines().count(), 1, "{said}");
    said
}

const PAGE: &str = include_str!("../../docs/json.md");

/// Returns the keys in the tables of one section of the page.
fn documented(section: &str) -> BTreeSet<String> {
    let after = PAGE.split(&format!("\n## {section}\n")).nth(1).unwrap_or_else(|| panic!("no section {section}"));
    let rows = after.split("\n## ").next().unwrap().lines().filter(|line| line.starts_with("| `"));
    let cells = rows.map(|row| row.trim_start_matches("| ").split(" | ").next().unwrap());
    cells.flat_map(|cell| cell.split(", ")).map(|key| key.trim_matches('`').to_owned()).collect()
}

/// Collects the path of every value that is neither an object nor an array.
fn keys(path: &str, value: &Value, found: &mut BTreeSet<String>) {
    match value {
        Value::Object(object) => {
            for (key, value) in object {
                // Keys of this object are names, so they are replaced by `*`.
                let key = if path.ends_with("by_trajectory") { "*" } else { key };
                let dot = if path.is_empty() { "" } else { "." };
                keys(&format!("{path}{dot}{key}"), value, found);
            }
        }
        Value::Array(array) if array.is_empty() => drop(found.insert(format!("{path}[]"))),
        Value::Array(array) => array.iter().for_each(|value| keys(&format!("{path}[]"), value, found)),
        _ => drop(found.insert(path.to_owned())),
    }
}

/// Checks that every command of a section prints exactly the documented keys. An object or array may be null or empty
/// instead of having its keys. Returns the output of the first command.
fn prints(folder: &Path, section: &str, commands: &[&[&str]]) -> Value {
    let mut first = None;
    for command in commands {
        let text = succeeds(folder, &[*command, &["--json"]].concat());
        let value: Value = serde_json::from_str(&text).unwrap();
        let mut found = BTreeSet::new();
        keys("", &value, &mut found);
        let found: BTreeSet<_> = found.into_iter().map(|key| key.trim_start_matches("[].").to_owned()).collect();
        let mut expected = documented(section);
        for key in &found {
            let inside = format!("{key}.");
            if expected.iter().any(|documented| documented.starts_with(&inside)) {
                expected.retain(|documented| !documented.starts_with(&inside));
                expected.insert(key.clone());
            }
        }
        assert_eq!(found, expected, "{command:?}");
        first.get_or_insert(value);
    }
    first.unwrap()
}

const SMALL: &str = r#"
name = "small"
flights = 20
duration_s = 6.0
scenario = "hover"

[spread]
thrust_factor_ratio = [0.6, 1.2]
"#;

fn small(test: &str) -> PathBuf {
    let folder = folder(test);
    fs::write(folder.join("small.toml"), SMALL).unwrap();
    let scenario = "description = \"d\"\nduration_s = 6\n[trajectory]\nkind = \"hover\"\nposition_m = [0, 0, 1]\n";
    fs::write(folder.join("flight.toml"), scenario).unwrap();
    folder
}

#[test]
fn lists_and_checks() {
    let folder = small("lists");
    let scenarios = prints(&folder, "Scenarios", &[&["scenarios"], &["check", "storm"], &["check", "flight.toml"]]);
    let names: Vec<_> = scenarios.as_array().unwrap().iter().map(|one| one["name"].as_str().unwrap()).collect();
    assert!(names.contains(&"hardware"), "{names:?}");
    let campaigns = prints(&folder, "Campaigns", &[&["campaigns"], &["check", "robustness"], &["check", "small.toml"]]);
    assert_eq!(campaigns[0]["name"], "robustness");
    assert_eq!(campaigns[0]["flights"], 10_000);
    let small: Value = serde_json::from_str(&succeeds(&folder, &["check", "small.toml", "--json"])).unwrap();
    assert_eq!(small["drawn"], serde_json::json!([{ "name": "thrust_factor_ratio", "ends": [0.6, 1.2] }]));
    assert_eq!(small["kind"], "campaign");
}

#[test]
fn flights() {
    let folder = small("flights");
    // The flight is long enough for all figures to be evaluated.
    let flown = prints(
        &folder,
        "Flights",
        &[
            &["fly", "flight.toml"],
            &["fly", "mocap", "--controller", "afbc", "--duration", "6"],
            &["paper", "--duration", "7"],
            &["campaign", "small.toml", "--flight", "1", "--out", "again"],
            &["results"],
        ],
    );
    let file: Value = serde_json::from_slice(&fs::read(folder.join("out/flight/summary.json")).unwrap()).unwrap();
    assert_eq!(flown, file);
    // The output without a command is the same.
    let paper = succeeds(&folder, &["--duration", "7", "--json"]);
    assert_eq!(serde_json::from_str::<Value>(&paper).unwrap()[0]["scenario"], "paper");
}

const SUITE: &str = r#"
[[source]]
name = "someone"
citation = "a paper"
differs = "everything"

[[flight]]
name = "still"
duration_s = 6.0
trajectory = { kind = "hover", position_m = [0, 0, 1] }
published = [{ law = "theirs", rms_m = 0.01, source = "someone" }]
"#;

#[test]
fn suites() {
    let folder = small("suites");
    fs::write(folder.join("suite.toml"), SUITE).unwrap();
    let flown = prints(&folder, "Suites", &[&["compare", "--suite", "suite.toml", "--controllers", "pid"]]);
    let file = fs::read(folder.join("out/suite/suite.json")).unwrap();
    assert_eq!(flown, serde_json::from_slice::<Value>(&file).unwrap());
    assert_eq!(
        (&flown[0]["contenders"][0]["lost"], &flown[0]["published"][0]["differs"]),
        (&0.into(), &"everything".into())
    );
    assert!(refused(&folder, &["compare", "--suite", "nothing", "--json"]).starts_with("nothing: no such suite; "));
}

#[test]
fn random_flights() {
    let folder = small("random");
    let fly = ["compare", "--suite", "random", "--flights", "2", "--controllers", "pid,indi"];
    let one = [&fly[..], &["--vehicle", "iris", "--seeds", "2", "--seed", "3", "--against", "pid"]].concat();
    let flown = prints(&folder, "Random flights", &[&one]);
    let file = fs::read(folder.join("out/random/random.json")).unwrap();
    assert_eq!(flown, serde_json::from_slice::<Value>(&file).unwrap());
    assert_eq!((&flown["first_seed"], &flown["seeds"], &flown["against"]), (&3.into(), &2.into(), &"pid".into()));
    let groups = flown["groups"].as_array().unwrap();
    assert_eq!((groups.len(), &groups[0]["vehicle"], &groups[0]["flights"]), (1, &"iris".into(), &4.into()));
    assert_eq!(groups[0]["contenders"][0]["log_difference"]["mean"], 0.0);
    let wins = |who: usize| groups[0]["contenders"][who]["best_or_level"].as_u64().unwrap();
    assert!(wins(0) + wins(1) >= 4);
}

#[test]
fn rough_estimates() {
    let folder = small("rough");
    let fly = ["compare", "--suite", "rough-estimate", "--vehicle", "paper", "--duration", "6"];
    let flown = prints(&folder, "Sensors that the vehicle is not told of", &[&fly]);
    let file = fs::read(folder.join("out/rough-estimate/rough-estimate.json")).unwrap();
    assert_eq!(flown, serde_json::from_slice::<Value>(&file).unwrap());
    let classes = flown["classes"].as_array().unwrap();
    assert_eq!((classes.len(), &classes[0]["class"], &classes[0]["known"]), (26, &"nothing".into(), &true.into()));
    assert_eq!((&classes[25]["class"], &classes[25]["flights"]), (&Value::Null, &25.into()));
    assert_eq!(flown["contender"], "afbc-monitored");
}

#[test]
fn comparisons_and_gains() {
    let folder = small("comparisons");
    let compared = prints(&folder, "Comparisons", &[&["compare", "flight.toml", "--seeds", "2"]]);
    let file = fs::read(folder.join("out/compare/comparison.json")).unwrap();
    assert_eq!(compared, serde_json::from_slice::<Value>(&file).unwrap());
    let tune = ["tune", "pid", "--scenario", "flight.toml", "--budget", "5"];
    let found = prints(&folder, "Gains found", &[&tune, &[&tune[..], &["--out", "pid.toml"]].concat()]);
    assert_eq!(found["tries"], 5);
    let toml = found["contender_toml"].as_str().unwrap();
    assert!(fs::read_to_string(folder.join("pid.toml")).unwrap().ends_with(toml));
}

#[test]
fn campaigns() {
    let folder = small("campaigns");
    for part in ["1/2", "2/2"] {
        succeeds(&folder, &["campaign", "small.toml", "--shard", part]);
    }
    let merge = ["merge", "out/small-1-of-2", "out/small-2-of-2", "--out", "merged"];
    let flown = prints(&folder, "Campaigns flown", &[&["campaign", "small.toml"], &merge]);
    assert_eq!(flown["contenders"][0]["flights"], 20);
    let file: Value = serde_json::from_slice(&fs::read(folder.join("merged/summary.json")).unwrap()).unwrap();
    assert_eq!(flown, file);
}

#[test]
fn replays() {
    let folder = folder("replays");
    crate::common::log_at_rest(&folder, 14);
    let replayed = prints(&folder, "Replays", &[&["replay", "rest.csv"]]);
    let file: Value = serde_json::from_slice(&fs::read(folder.join("out/replay-rest/summary.json")).unwrap()).unwrap();
    assert_eq!(replayed, file);
}

#[test]
fn errors_are_one_line_on_stderr_with_json_too() {
    let folder = small("errors");
    fs::write(folder.join("bad.toml"), SMALL.replace("flights = 20", "flights = 0")).unwrap();
    assert!(refused(&folder, &["check", "bad.toml", "--json"]).starts_with("bad.toml:3: flights: 0 is out of range"));
    assert!(
        refused(&folder, &["campaign", "bad.toml", "--json"]).starts_with("bad.toml:3: flights: 0 is out of range")
    );
    refused(&folder, &["fly", "nothing", "--json"]);
    refused(&folder, &["compare", "nothing", "--json"]);
    refused(&folder, &["tune", "nothing", "--json"]);
    refused(&folder, &["merge", "nothing", "--out", "merged", "--json"]);
    refused(&folder, &["replay", "nothing", "--json"]);
}

#[test]
fn a_campaign_is_distinguished_from_a_scenario() {
    let folder = small("kinds");
    // The kind of a file is recognised without an extension, and despite wrong values.
    fs::write(folder.join("plain"), SMALL).unwrap();
    fs::write(folder.join("bad.toml"), SMALL.replace("[0.6, 1.2]", "[6.0, 120]")).unwrap();
    fs::write(folder.join("bad-flight.toml"), "plant = 1\n[trajectory]\nkind = \"paper\"\n").unwrap();
    for file in ["small.toml", "./small.toml", "plain", "robustness"] {
        let said = succeeds(&folder, &["check", file]);
        assert!(said.contains(": ok, ") && said.contains(" flights of "), "{said}");
        assert!(said.ends_with(&format!("; this is a campaign; fly it with `sitl campaign {file}`\n")), "{said}");
    }
    for file in ["small.toml", "plain", "robustness", "bad.toml"] {
        for command in [&["fly"][..], &["compare"], &["pil"], &["tune", "pid", "--scenario"]] {
            let said = refused(&folder, &[command, &[file]].concat());
            assert_eq!(said, format!("{file}: this is a campaign; fly it with `sitl campaign {file}`\n"));
        }
    }
    for file in ["hardware", "flight.toml", "bad-flight.toml"] {
        let said = refused(&folder, &["campaign", file]);
        assert!(said.starts_with(&format!("{file}: this is a scenario; fly it with `sitl fly {file}`; ")), "{said}");
    }
    assert_eq!(refused(&folder, &["campaign", "robustnes"]), "robustnes: no such campaign; did you mean robustness?\n");
    assert!(refused(&folder, &["check", "bad.toml"]).starts_with("bad.toml:8: spread.thrust_factor_ratio: 120 is out"));
    assert!(!folder.join("out").exists());
}

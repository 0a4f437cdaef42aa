//! Tests `sitl compare`.

#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

use crate::common::{command, folder, refused, succeeds};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

pub(crate) fn sitl_on(threads: &str, folder: &Path, arguments: &[&str]) -> Output {
    command(folder, arguments).env("RAYON_NUM_THREADS", threads).output().unwrap()
}

pub(crate) fn sitl(folder: &Path, arguments: &[&str]) -> Output {
    sitl_on("2", folder, arguments)
}

pub(crate) fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

/// Two flights on the racer, with a published result.
pub(crate) const SUITE: &str = r#"
description = "two"

[[source]]
name = "someone"
citation = "a paper"
differs = "flown"

[[flight]]
name = "racing"
duration_s = 9.0
vehicle = { name = "racer" }
sensors = { noise = 0.001 }
trajectory = { kind = "circle", centre_m = [0, 0, 2], radius_m = 1.0, period_s = 4.0 }
published = [{ law = "theirs", rms_m = 0.0123, source = "someone" }]

[[flight]]
name = "weak"
like = "racing"
sensors = { noise = 0.0 }
rotor_fault = [{ rotor = 2, efficiency = 0.0, start_s = 6.0 }]
"#;

/// Noisy circle of 8 s, and a PID with far too low gains.
pub(crate) const SOFT: &str = r#"
name = "round"
duration_s = 8.0
profile = "flight"
controllers = ["backstepping"]

[rotors]
time_constant_s = 0.02
force_max_n = 3.0

[sensors]
noise = 0.001

[trajectory]
kind = "circle"
centre_m = [0.0, 0.0, 2.0]
radius_m = 1.0
period_s = 6.0

[[contender]]
name = "soft"
controller = "pid"
gains = { position_p_1_s = 0.6, velocity_p_1_s = 1.5, climb_p_1_s = 1.5 }
"#;

pub(crate) fn soft(test: &str) -> PathBuf {
    let folder = folder(test);
    fs::write(folder.join("soft.toml"), SOFT).unwrap();
    folder
}

#[test]
fn compares_by_the_figures_of_fly() {
    let folder = soft("figures");
    let once = ["compare", "soft.toml", "--seeds", "1", "--controllers", "soft,backstepping,indi"];
    let table = succeeds(&sitl(&folder, &once));
    assert!(table.contains("soft ") && table.contains("INDI "), "{table}");
    let compared = json(&folder.join("out/compare/comparison.json"));
    succeeds(&sitl(&folder, &["fly", "soft.toml"]));
    let flown = json(&folder.join("out/round/summary.json"));
    for run in flown.as_array().unwrap() {
        let contenders = compared[0]["contenders"].as_array().unwrap();
        let same = contenders.iter().find(|contender| contender["name"] == run["contender"]).unwrap();
        assert_eq!(same["mean"]["rmse_x_m"], run["rmse"]["x_m"]);
        assert_eq!(same["mean"]["rmse_psi_rad"], run["rmse"]["psi_rad"]);
        assert_eq!(same["mean"]["mean_abs_delta_u4_n"], run["mean_abs_delta_u_n"][3]);
    }
    assert_eq!(compared[0]["contenders"][1]["ratio"], 1.0);
    for figure in ["errors.svg", "rmse.svg"] {
        let svg = fs::read_to_string(folder.join("out/compare").join(figure)).unwrap();
        roxmltree::Document::parse(&svg).unwrap();
    }
}

/// By default, flies ten seeds if the seed affects a flight, otherwise one.
#[test]
fn flies_several_seeds_where_they_matter() {
    let folder = soft("usual-seeds");
    let fly = |more: &[&str]| {
        let table = succeeds(&sitl(
            &folder,
            &[&["compare", "soft.toml", "hover", "--controllers", "pid", "--force"], more].concat(),
        ));
        let compared = json(&folder.join("out/compare/comparison.json"));
        let flown = |scenario: usize| compared[scenario]["contenders"][0]["seeds"].as_array().unwrap().len();
        (table, [flown(0), flown(1)])
    };
    assert_eq!(fly(&["--seeds", "1"]).1, [1, 1]);
    let (table, seeds) = fly(&[]);
    assert_eq!(seeds, [10, 1]);
    assert!(table.contains("over 10 seeds") && table.contains("Wilcoxon"), "{table}");
}

/// Recomputes the statistics in the files from the flights in the files.
#[test]
fn medians_and_differences_are_those_of_the_flights() {
    let folder = soft("statistics");
    let fly = ["compare", "soft.toml", "--controllers", "pid,soft,afbc", "--seeds", "7", "--against", "pid"];
    let table = succeeds(&sitl(&folder, &fly));
    assert!(table.contains("minus PID's"), "{table}");
    let out = folder.join("out/compare");
    let compared = &json(&out.join("comparison.json"))[0];
    assert_eq!(compared["against"], "pid");
    let text = fs::read_to_string(out.join("comparison.csv")).unwrap();
    let rows: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
    let column = rows[0].iter().position(|head| *head == "rms_m").unwrap();
    let of = |who: &str| -> Vec<f64> {
        rows.iter().filter(|row| row[1] == who).map(|row| row[column].parse().unwrap()).collect()
    };
    let sorted = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values
    };
    for contender in compared["contenders"].as_array().unwrap() {
        let who = contender["name"].as_str().unwrap();
        let figure = &contender["figures"][0];
        assert_eq!(figure["name"], "rms_m");
        let own = sorted(of(who));
        // Of seven values, the median is the fourth; the interval between smallest and largest covers 98 %.
        for (key, expected) in [("median", own[3]), ("low_95", own[0]), ("high_95", own[6])] {
            // JSON keeps all but the last digit.
            assert!((figure[key].as_f64().unwrap() / expected - 1.0).abs() < 1e-12, "{who} {key}");
        }
        if who == "pid" {
            assert_eq!((&figure["difference"], &figure["p"]), (&Value::Null, &Value::Null));
            continue;
        }
        let differences = sorted(of(who).iter().zip(of("pid")).map(|(own, pid)| own - pid).collect());
        assert!((figure["difference"].as_f64().unwrap() / differences[3] - 1.0).abs() < 1e-9, "{who}");
    }
    // All seven flights of two laws are worse than PID's: p is 2/2^7, and twice that after Holm's correction.
    let soft = &compared["contenders"][1]["figures"][0];
    assert_eq!((&soft["p"], &soft["rank_biserial"]), (&(1.0 / 64.0).into(), &1.0.into()));
    assert_eq!(soft["p_holm"], 1.0 / 32.0);
    let statistics = fs::read_to_string(out.join("statistics.csv")).unwrap();
    assert_eq!(statistics.lines().count(), 1 + 3 * 7);
    let row = statistics.lines().find(|row| row.starts_with("round,soft,7,0,rms_m,")).unwrap();
    assert!(row.ends_with(",0.015625,0.03125,1.0"), "{row}");
}

#[test]
fn prints_the_tables_of_its_folder_for_a_paper() {
    let folder = soft("tables");
    let fly = ["compare", "soft.toml", "--controllers", "pid,soft", "--seeds", "6", "--table"];
    for (format, file, begins) in
        [("latex", "tables.tex", "% \\usepackage{booktabs}\n"), ("markdown", "tables.md", "round: ")]
    {
        let printed = succeeds(&sitl(&folder, &[&fly[..], &[format]].concat()));
        assert_eq!(printed, fs::read_to_string(folder.join("out/compare").join(file)).unwrap());
        assert!(printed.starts_with(begins) && printed.contains("soft") && printed.contains("0.031"), "{printed}");
    }
    let suite = ["compare", "--suite", "two.toml", "--controllers", "pid,indi", "--table", "latex", "--seeds", "1"];
    fs::write(folder.join("two.toml"), SUITE).unwrap();
    let printed = succeeds(&sitl(&folder, &suite));
    assert!(printed.contains("\\label{tab:two-2}") && printed.contains("racing"), "{printed}");
    let random = ["compare", "--suite", "random", "--vehicle", "iris", "--flights", "2", "--controllers", "pid,indi"];
    let printed = succeeds(&sitl(&folder, &[&random[..], &["--table", "markdown"]].concat()));
    assert!(printed.contains("| law | best or level |"), "{printed}");
}

/// Tables fit any terminal width with the same content: columns without room move below.
#[test]
fn tables_narrow_to_the_terminal() {
    let folder = soft("narrow");
    fs::write(folder.join("two.toml"), SUITE).unwrap();
    for (arguments, columns) in [
        (&["compare", "soft.toml", "--controllers", "pid,indi,soft", "--seeds", "2"][..], ["48", "80"]),
        (&["compare", "--suite", "two.toml", "--controllers", "pid,indi,mpc,l1,dfbc", "--seeds", "1"], ["48", "80"]),
        (
            &["compare", "--suite", "random", "--vehicle", "iris", "--flights", "1", "--controllers", "pid,indi"],
            ["64", "80"],
        ),
    ] {
        let shown = |columns: &str| {
            let all = [arguments, &["--force"]].concat();
            succeeds(&command(&folder, &all).env("COLUMNS", columns).output().unwrap())
        };
        let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<BTreeSet<_>>();
        let wide = shown("100");
        for columns in columns {
            let narrow = shown(columns);
            // Paths to copy are not wrapped.
            let lines = narrow.lines().filter(|line| !line.contains("report.html"));
            let widest = lines.map(|line| line.chars().count()).max().unwrap();
            assert!(widest <= columns.parse().unwrap(), "{widest}:\n{narrow}");
            let rules = |text: &str| words(text).into_iter().filter(|word| !word.starts_with('─')).collect::<Vec<_>>();
            assert_eq!(rules(&narrow), rules(&wide), "{narrow}\n{wide}");
        }
    }
}

#[test]
fn compares_over_seeds_alike_on_any_number_of_threads() {
    let folder = soft("seeds");
    let fly = |threads, out| {
        let arguments = ["compare", "soft.toml", "circle", "--controllers", "pid,soft", "--seeds", "3", "--out", out];
        succeeds(&sitl_on(threads, &folder, &arguments))
    };
    let table = fly("1", "one");
    fly("3", "three");
    for file in ["comparison.csv", "comparison.json", "statistics.csv", "tables.tex", "report.html", "round-errors.svg"]
    {
        let [one, three] = ["one", "three"].map(|out| fs::read(folder.join(out).join(file)).unwrap());
        assert!(one == three, "{file}");
    }
    assert!(table.contains("round: root mean square distance from the reference over 3 seeds:"), "{table}");
    let rows = fs::read_to_string(folder.join("one/comparison.csv")).unwrap();
    assert_eq!(rows.lines().count(), 1 + 2 * 2 * 3);
    let pid = &json(&folder.join("one/comparison.json"))[0]["contenders"][0];
    assert_eq!(pid["seeds"], serde_json::json!([0, 1, 2]));
    // Another seed gives another flight.
    assert!(pid["standard_deviation"]["rmse_x_m"].as_f64().unwrap() > 0.0);
}

#[test]
fn a_lost_vehicle_is_part_of_the_comparison() {
    let folder = folder("lost");
    let moment = "[[gust]]\naxis = \"roll\"\nmoment_n_m = 1.2\nstart_s = 1.0\n";
    fs::write(folder.join("lost.toml"), format!("duration_s = 6.0\n{moment}[trajectory]\nkind = \"paper\"\n")).unwrap();
    let table = succeeds(&sitl(&folder, &["compare", "lost.toml", "--controllers", "pid,indi"]));
    assert!(table.contains("PID   lost at t = 1.") && table.contains("INDI  lost at t = 1."), "{table}");
    let compared = json(&folder.join("out/compare/comparison.json"));
    assert_eq!(compared[0]["contenders"][0]["mean"]["rmse_x_m"], Value::Null);
    assert_eq!(compared[0]["contenders"][0]["lost"], 1);
}

#[test]
fn compare_refuses_what_it_cannot_fly() {
    let folder = soft("refused");
    let line = refused(&sitl(&folder, &["compare", "soft.toml", "--controllers", "sof"]));
    assert_eq!(line, "controllers sof: no such controller; did you mean soft?\n");
    let line = refused(&sitl(&folder, &["compare", "soft.toml", "--controllers", "zzz"]));
    assert!(line.starts_with("controllers zzz: no such controller; there are afbc, afbc-as-printed,"), "{line}");
    for (arguments, expected) in [
        (&["compare", "soft.toml", "--controllers", "abfc"][..], "did you mean afbc?"),
        (&["compare", "soft.toml", "--against", "sotf"], "did you mean soft?"),
        (&["compare", "circel"], "did you mean circle?"),
        (&["fly", "soft.toml", "--controller", "abfc"], "did you mean afbc?"),
        (&["tune", "abfc"], "did you mean afbc?"),
        (&["replay", "a.log", "--exact", "--change", "law=abfc"], "did you mean afbc?"),
    ] {
        let line = refused(&sitl(&folder, arguments));
        assert!(line.contains(expected), "{arguments:?}: {line}");
    }
    assert_eq!(line.lines().count(), 1);
    let line = refused(&sitl(&folder, &["compare", "hardwear"]));
    assert_eq!(line, "hardwear: no such scenario; did you mean hardware?\n");
    let line = refused(&sitl(&folder, &["compare", "hover", "--controllers", "pid,pid"]));
    assert_eq!(line, "controllers pid: the controller is named twice; name it once\n");
    refused(&sitl(&folder, &["compare", "hover", "--seeds", "0"]));
    assert!(!folder.join("out").exists());
}

/// Repeats the example of docs/python.md on the command line: in every scenario, AFBC is the law of the profile
/// `flight`, whichever scenario comes first.
#[test]
fn a_comparison_flies_the_flown_law_in_any_order() {
    let folder = folder("profiles");
    let rms = |scenarios: [&str; 2]| {
        let out = scenarios.join("-");
        let fly = ["--controllers", "afbc,pid", "--seeds", "1", "--out", &out];
        succeeds(&sitl(&folder, &[&["compare"], &scenarios[..], &fly].concat()));
        let compared = json(&folder.join(&out).join("comparison.json"));
        let of = |scenario: &Value| {
            let contenders = scenario["contenders"].as_array().unwrap();
            let rms = contenders.iter().map(|contender| contender["figures"][0]["median"].as_f64().unwrap()).collect();
            (scenario["scenario"].as_str().unwrap().to_owned(), rms)
        };
        let mut all: Vec<(String, Vec<f64>)> = compared.as_array().unwrap().iter().map(of).collect();
        all.sort_by(|a, b| a.0.cmp(&b.0));
        all
    };
    let (one, other) = (rms(["paper", "wind"]), rms(["wind", "paper"]));
    assert_eq!(one, other);
    for (scenario, rms) in one {
        assert!(rms[0] < 3.0 * rms[1], "{scenario}: AFBC {} m, PID {} m", rms[0], rms[1]);
    }
}

//! Tests `sitl compare`, `sitl tune` and `sitl again`.

#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

use crate::common::{command, folder, refused, succeeds};
use afbc_files::seal;
use afbc_scenario::contender::ControllerKind;
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Output;

fn sitl_on(threads: &str, folder: &Path, arguments: &[&str]) -> Output {
    command(folder, arguments).env("RAYON_NUM_THREADS", threads).output().unwrap()
}

fn sitl(folder: &Path, arguments: &[&str]) -> Output {
    sitl_on("2", folder, arguments)
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

/// Noisy circle of 8 s, and a PID with far too low gains.
const SOFT: &str = r#"
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

fn soft(test: &str) -> PathBuf {
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
    assert!(table.contains("less PID's"), "{table}");
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

/// Two flights on the racer, with a published result.
const SUITE: &str = r#"
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

#[test]
fn a_suite_is_one_report_alike_on_any_number_of_threads() {
    let folder = folder("suite");
    fs::write(folder.join("two.toml"), SUITE).unwrap();
    let fly = |threads, out| {
        let of =
            ["compare", "--suite", "two.toml", "--controllers", "pid,afbc-monitored", "--seeds", "2", "--out", out];
        succeeds(&sitl_on(threads, &folder, &of))
    };
    let table = fly("1", "one");
    fly("3", "three");
    for file in ["suite.csv", "suite.json", "report.html", "racing.svg", "weak.svg"] {
        let [one, three] = ["one", "three"].map(|out| fs::read(folder.join(out).join(file)).unwrap());
        assert!(one == three, "{file}");
    }
    assert!(table.contains("2 of 2 lost") && table.contains("PID"), "{table}");
    assert_eq!(fs::read_to_string(folder.join("one/suite.csv")).unwrap().lines().count(), 1 + 2 * 2 * 2);
    let flights = json(&folder.join("one/suite.json"));
    let [racing, weak] = [0, 1].map(|flight| flights[flight]["contenders"][0].clone());
    assert_eq!((&weak["lost"], &weak["mean"]["rms_m"], &racing["lost"]), (&2.into(), &Value::Null, &0.into()));
    let page = fs::read_to_string(folder.join("one/report.html")).unwrap();
    for word in ["0.0123", "someone", "a paper", "flown", "lost at t = ", "rotor fault", "<svg"] {
        assert!(page.contains(word), "no {word}");
    }
    // The folder belongs to this suite: other results do not overwrite it.
    let other = refused(&sitl(&folder, &["compare", "hover", "--out", "one"]));
    assert_eq!(other.lines().count(), 1, "{other}");
}

#[test]
fn a_suites_table_is_written_between_its_markers() {
    let folder = folder("suite-page");
    fs::write(folder.join("two.toml"), SUITE).unwrap();
    let before = "# Page\n\n<!-- suite two: begin -->\nold\n<!-- suite two: end -->\nrest\n";
    fs::write(folder.join("page.md"), before).unwrap();
    let write = ["compare", "--suite", "two.toml", "--controllers", "pid", "--write", "page.md"];
    assert_eq!(succeeds(&sitl(&folder, &write)), "");
    let page = fs::read_to_string(folder.join("page.md")).unwrap();
    assert!(
        page.starts_with("# Page\n\n<!-- suite two: begin -->\n| flight | PID |\n|---|--:|\n| `racing`: "),
        "{page}"
    );
    assert!(page.ends_with("<!-- suite two: end -->\nrest\n") && !page.contains("old"), "{page}");
    assert!(page.contains("| `weak`:  | lost ") && page.contains("theirs 0.0123 (someone)"), "{page}");
    succeeds(&sitl(&folder, &write));
    assert_eq!(fs::read_to_string(folder.join("page.md")).unwrap(), page, "written again");
    assert!(!folder.join("out").exists());

    fs::write(folder.join("page.md"), "no markers").unwrap();
    let line = refused(&sitl(&folder, &write));
    assert!(
        line.starts_with("page.md: the page has no place for the table; add the lines <!-- suite two: begin -->"),
        "{line}"
    );
}

#[test]
fn a_suite_that_cannot_be_flown_is_refused_in_one_line() {
    let folder = folder("suite-refused");
    fs::write(folder.join("bad.toml"), SUITE.replace("like = \"racing\"", "like = \"nobody\"")).unwrap();
    for (arguments, expected) in [
        (&["--suite", "feild"][..], "feild: no such suite; did you mean field?"),
        (&["--suite", "./nothing.toml"], "./nothing.toml: no such file; `sitl suites` lists the built-in ones"),
        (&["--suite", "bad.toml"], "bad.toml:19: flight.like: no flight above is called \"nobody\""),
        (&["--suite", "faults", "--controllers", "sof"], "controllers sof: no such controller; there are afbc,"),
        (&["hover", "--against", "sof"], "--against sof: does not fly; name one of afbc"),
    ] {
        let line = refused(&sitl(&folder, &[&["compare"], arguments].concat()));
        assert!(line.starts_with(expected) && line.lines().count() == 1, "{line}");
    }
    refused(&sitl(&folder, &["compare", "hover", "--suite", "field"]));
    refused(&sitl(&folder, &["compare", "--suite", "field", "--vehicle", "racer"]));
    refused(&sitl(&folder, &["compare", "--write", "page.md"]));
    assert!(!folder.join("out").exists());
    let listed = succeeds(&sitl(&folder, &["suites"]));
    assert!(listed.contains("field ") && listed.contains("faults "), "{listed}");
    fs::write(folder.join("copy.toml"), succeeds(&sitl(&folder, &["suites", "faults"]))).unwrap();
}

#[test]
fn random_flights_are_alike_on_any_number_of_threads() {
    let folder = folder("random");
    let fly = |threads, out| {
        let drawn = ["compare", "--suite", "random", "--seed", "2", "--flights", "2", "--controllers", "pid,indi"];
        succeeds(&sitl_on(threads, &folder, &[&drawn[..], &["--out", out]].concat()))
    };
    let table = fly("1", "one");
    fly("3", "three");
    for file in ["flights.csv", "random.json", "report.html"] {
        let [one, three] = ["one", "three"].map(|out| fs::read(folder.join(out).join(file)).unwrap());
        assert!(one == three, "{file}");
    }
    assert!(table.starts_with("Suite random: seed 2, 2 flights of each vehicle and seed, on the truth"), "{table}");
    assert!(table.contains("all vehicles, 12 flights") && table.contains("over PID [95 %]"), "{table}");
    let rows = fs::read_to_string(folder.join("one/flights.csv")).unwrap();
    assert_eq!(rows.lines().count(), 1 + 6 * 2 * 2);
    let page = fs::read_to_string(folder.join("one/report.html")).unwrap();
    for word in ["racer", "all vehicles", "best or level", "resamples"] {
        assert!(page.contains(word), "no {word}");
    }
    // A user's vehicle file flies the same draws, also on its own estimate; the table in the page shows the same
    // flights.
    let mine = succeeds(&sitl(&folder, &["vehicles", "iris"]));
    fs::write(folder.join("mine.toml"), mine).unwrap();
    let own = ["compare", "--suite", "random", "--vehicle", "mine.toml", "--flights", "2", "--controllers", "pid"];
    let own = [&own[..], &["--on-estimate"]].concat();
    let table = succeeds(&sitl(&folder, &own));
    // The text is wrapped to the terminal, so words are joined again.
    let words = table.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("the instruments of the scenario mocap") && words.contains("mine, 2 flights"), "{table}");
    fs::write(folder.join("page.md"), "<!-- suite random: begin -->\n<!-- suite random: end -->\n").unwrap();
    succeeds(&sitl(&folder, &[&own[..], &["--write", "page.md"]].concat()));
    let page = fs::read_to_string(folder.join("page.md")).unwrap();
    assert!(page.contains("| mine, 2 flights | best or level |") && page.contains("\n| PID | 2 (100 %) | "), "{page}");
}

#[test]
fn random_flights_that_cannot_be_drawn_are_refused_in_one_line() {
    let folder = folder("random-refused");
    let own = "this suite is drawn from a seed, so it has no file; fly it with `sitl compare --suite random --seed N`";
    for (arguments, expected) in [
        (&["suites", "random"][..], &*format!("random: {own}")),
        (&["compare", "--suite", "random", "--vehicle", "raser"], "vehicle: \"raser\" is no built-in vehicle"),
        (&["compare", "--suite", "random", "--vehicle", "./no.toml"], "./no.toml: no such file"),
        (&["compare", "--suite", "random", "--against", "sof"], "--against sof: does not fly; name one of afbc, "),
        (&["compare", "--suite", "field", "--seed", "2"], "--seed: this option needs --suite random or rough-estimate"),
        (
            &["compare", "--suite", "field", "--vehicle", "racer"],
            "--vehicle: this option needs --suite random or rough-estimate",
        ),
    ] {
        let line = refused(&sitl(&folder, arguments));
        assert!(line.starts_with(expected) && line.lines().count() == 1, "{line}");
    }
    refused(&sitl(&folder, &["compare", "--suite", "random", "--flights", "0"]));
    refused(&sitl(&folder, &["compare", "--suite", "random", "--on-estimate", "nothing"]));
    refused(&sitl(&folder, &["compare", "hover", "--seed", "2"]));
    assert!(!folder.join("out").exists());
    assert!(succeeds(&sitl(&folder, &["suites"])).contains("random           72 flights  drawn from --seed"));
}

/// Runs the suite with short flights: same bytes on any number of threads, a row for each class, and a one-line error
/// for options that it does not take.
#[test]
fn rough_flights_are_alike_on_any_number_of_threads() {
    let folder = folder("rough");
    let short = ["compare", "--suite", "rough-estimate", "--vehicle", "iris", "--duration", "7", "--seed", "3"];
    let table = succeeds(&sitl_on("1", &folder, &[&short[..], &["--out", "one"]].concat()));
    succeeds(&sitl_on("3", &folder, &[&short[..], &["--out", "three"]].concat()));
    for file in ["flights.csv", "rough-estimate.json", "report.html", "tables.md", "tables.tex"] {
        let [one, three] = ["one", "three"].map(|out| fs::read(folder.join(out).join(file)).unwrap());
        assert!(one == three, "{file}");
    }
    assert!(table.starts_with("Suite rough-estimate: Seed 3, flights of each vehicle, class and seed: 1"), "{table}");
    let classes = ["nothing", "vibration", "bumps", "field", "gnss-jump", "tracker-flip", "mixture", "all"];
    for class in classes {
        assert!(table.lines().any(|line| line.starts_with(&format!("{class} "))), "no {class} in {table}");
    }
    assert_eq!(fs::read_to_string(folder.join("one/flights.csv")).unwrap().lines().count(), 1 + 25);
    fs::write(folder.join("page.md"), "<!-- suite rough-estimate: begin -->\n<!-- suite rough-estimate: end -->\n")
        .unwrap();
    succeeds(&sitl(&folder, &[&short[..], &["--write", "page.md"]].concat()));
    let page = fs::read_to_string(folder.join("page.md")).unwrap();
    assert!(page.contains("\n| class | known | flights | NEES |") && page.contains("\n| mixture |  | 1 | "), "{page}");
    assert!(succeeds(&sitl(&folder, &["suites"])).contains("rough-estimate  150 flights  drawn from --seed"));
    let rough = ["compare", "--suite", "rough-estimate"];
    for (arguments, expected) in [
        (
            &["suites", "rough-estimate"][..],
            "rough-estimate: this suite is drawn from a seed, so it has no file; fly it with",
        ),
        (
            &[&rough[..], &["--on-estimate"]].concat(),
            "--on-estimate: only --suite random has this option; leave --on-estimate out",
        ),
        (
            &[&rough[..], &["--against", "afbc-monitored"]].concat(),
            "--against: --suite rough-estimate compares no contenders",
        ),
        (
            &[&rough[..], &["--controllers", "afbc,pid"]].concat(),
            "--controllers: this suite judges the estimate with one law",
        ),
        (
            &["compare", "--suite", "random", "--duration", "9"],
            "--duration: only --suite rough-estimate has this option; leave --duration out",
        ),
    ] {
        let line = refused(&sitl(&folder, arguments));
        assert!(line.starts_with(expected) && line.lines().count() == 1, "{line}");
    }
}

/// Returns the two costs in the first line of `sitl tune`'s output.
fn costs(fragment: &str) -> [f64; 2] {
    let line = fragment.lines().next().unwrap();
    let after = |word: &str| line.split(word).nth(1).unwrap().split([',', ' ']).next().unwrap().parse().unwrap();
    [after("before "), after(": cost ")]
}

#[test]
fn tune_improves_a_bad_start_alike_on_any_number_of_threads() {
    let folder = soft("tune");
    let tune = |threads, seed| {
        let arguments = ["tune", "soft", "--scenario", "soft.toml", "--budget", "60", "--seed", seed];
        succeeds(&sitl_on(threads, &folder, &arguments))
    };
    let fragment = tune("1", "1");
    assert_eq!(fragment, tune("3", "1"));
    assert_ne!(fragment, tune("2", "2"));
    let [before, after] = costs(&fragment);
    assert!(after < 0.7 * before, "{before} to {after}");

    // The output is valid in a scenario file, and flies with the stated cost.
    fs::write(folder.join("tuned.toml"), format!("{SOFT}\n{fragment}")).unwrap();
    let again =
        succeeds(&sitl(&folder, &["tune", "soft-tuned", "--scenario", "tuned.toml", "--budget", "1", "--seed", "3"]));
    assert_eq!(costs(&again), [after, after]);
}

#[test]
fn what_tune_prints_of_every_law_flies() {
    let folder = soft("every-law");
    let mut file = SOFT.to_owned();
    let laws = ControllerKind::ALL.map(ControllerKind::name);
    for law in laws {
        let out = format!("{law}.toml");
        let arguments =
            ["tune", law, "--scenario", "circle", "--scenario", "soft.toml", "--budget", "20", "--out", &out];
        let said = succeeds(&sitl(&folder, &arguments));
        assert!(said.ends_with(&format!("gains in {out}\n")), "{said}");
        file += &fs::read_to_string(folder.join(out)).unwrap();
    }
    fs::write(folder.join("all.toml"), file).unwrap();
    let checked = succeeds(&sitl(&folder, &["check", "all.toml"]));
    assert!(checked.contains(&laws.map(|law| format!("{law}-tuned")).join(", ")), "{checked}");
}

#[test]
fn tune_refuses_what_it_cannot_do() {
    let folder = soft("tune-refused");
    let line = refused(&sitl(&folder, &["tune", "lqr"]));
    let laws = ControllerKind::ALL.map(ControllerKind::name).join(", ");
    assert_eq!(line, format!("lqr: no such controller; the laws are {laws}\n"));
    let line = refused(&sitl(&folder, &["tune", "hard", "--scenario", "soft.toml"]));
    assert!(line.ends_with("; the scenario's contenders backstepping, soft\n"), "{line}");
    let line = refused(&sitl(&folder, &["tune", "pid", "--out", "nowhere/pid.toml"]));
    assert!(
        line.starts_with("nowhere/pid.toml: the file cannot be written (the folder nowhere does not exist); "),
        "{line}"
    );
    refused(&sitl(&folder, &["tune", "pid", "--budget", "0"]));
}

/// Returns the number of tries in the first line of `sitl tune`'s output.
fn tries(fragment: &str) -> &str {
    fragment.lines().next().unwrap().split("after ").nth(1).unwrap().split(' ').next().unwrap()
}

#[test]
fn tune_tries_as_many_gains_as_asked() {
    let folder = soft("budget");
    // A generation has about ten tries. The budgets are below one generation, between two, and several with a
    // remainder.
    for budget in ["1", "2", "9", "12", "13", "14", "40"] {
        let fragment = succeeds(&sitl(&folder, &["tune", "soft", "--scenario", "soft.toml", "--budget", budget]));
        assert_eq!(tries(&fragment), budget);
    }
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

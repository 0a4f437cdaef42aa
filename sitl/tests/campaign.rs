//! Tests `sitl campaign`, `merge` and `campaigns`.

#![expect(clippy::unwrap_used, reason = "tests")]

use crate::common::{command, folder, sitl, succeeds};
use afbc_campaign::{self as campaign, Campaign, Manifest, Shard, built_in};
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

/// Short flights of two contenders on two courses, some of which lose the vehicle.
const SMALL: &str = include_str!("../../crates/campaign/tests/small.toml");

fn parse(text: &str) -> Campaign {
    campaign::parse("small.toml", text, "small", Path::new("")).unwrap()
}

fn results_of(path: &Path) -> Vec<u8> {
    fs::read(path.join("results.parquet")).unwrap()
}

/// Mistakes in a campaign file: text, its replacement, and line, key and message of the error.
const BAD: [(&str, &str, &str); 22] = [
    ("flights = 150", "flights = 0", ":3: flights: 0 is out of range: it must lie within 1 to 1e7"),
    ("flights = 150", "flights = 1.5", ":3: flights: 1.5 is not a whole number"),
    ("flights = 150", "flight = 150", ":3: flight: unknown key; did you mean flights?"),
    ("seed = 7", "seed = -1", ":4: seed: -1 is out of range"),
    // A seed must not be rounded to the nearest float, which may be the largest seed or one above it.
    ("seed = 7", "seed = 9007199254740992", ":4: seed: 9007199254740992 is out of range: it must lie within 0 to 9.0"),
    ("seed = 7", "seed = 9007199254740993", ":4: seed: 9007199254740993 is out of range"),
    ("seed = 7", "seed = 0x20000000000000", ":4: seed: 0x20000000000000 is out of range"),
    ("seed = 7", "seed = 99999999999999999999", ":4: seed: 99999999999999999999 is out of range"),
    ("seed = 7", "seed = 9007199254740992.0", ":4: seed: 9.007199254740992e15 is out of range"),
    ("seed = 7", "seed = 9007199254740991.4", ":4: seed: 9007199254740991.4 is not a whole number"),
    ("seed = 7", "seed = 1e-3", ":4: seed: 1e-3 is not a whole number"),
    ("flights = 150", "flights = 10000001", ":3: flights: 10000001 is out of range: it must lie within 1 to 1e7"),
    (
        "scenario = \"hover\"",
        "scenario = \"hovr\"",
        ":6: scenario: \"hovr\" is no built-in scenario; did you mean \"hover\"?",
    ),
    ("scenario = \"hover\"", "", ": scenario: missing; "),
    ("scenario = \"hover\"", "scenario = \"none.toml\"", "none.toml: no such file"),
    ("\"circle\"]", "\"hover\"]", ":7: trajectories: \"hover\" is listed twice"),
    ("[\"hover\", \"circle\"]", "[]", ":7: trajectories: the list is empty"),
    ("mass_ratio", "mas_ratio", ":10: spread.mas_ratio: unknown key; did you mean mass_ratio?"),
    ("[0.7, 1.3]", "[1.3, 0.7]", ":10: spread.mass_ratio: 1.3 is above 0.7; write the smaller number first"),
    ("[0.7, 1.3]", "[0.7, 130]", ":10: spread.mass_ratio: 130 is out of range: it must lie within 0.01 to 100"),
    ("rotor_efficiency = [0.0, 1.0]\n", "", "spread.fault_rotor: the spread has no effect without rotor_efficiency"),
    ("[1, 4]", "[1.5, 4]", "spread.fault_rotor: only whole numbers can be drawn"),
];

#[test]
fn a_bad_file_gets_one_line() {
    let folder = folder("bad");
    for (from, to, said) in BAD {
        let text = SMALL.replacen(from, to, 1);
        assert_ne!(text, SMALL);
        fs::write(folder.join("bad.toml"), text).unwrap();
        let output = sitl(&folder, &["campaign", "bad.toml"]);
        let error = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{error}");
        assert!(error.contains(said), "{said}, not {error}");
        assert_eq!(error.lines().count(), 1, "{error}");
        assert!(!folder.join("out").exists(), "{to}");
    }
    for (arguments, said) in [
        (&["campaign", "robust"][..], "robust: no such campaign; "),
        (&["campaign", "small.toml", "--flight", "150"], "the campaign has flights 0 to 149"),
        (&["campaign", "small.toml", "--flight", "1", "--contender", "me"], "its contenders are afbc, backstepping"),
        (&["campaign", "small.toml", "--shard", "3/2"], "a shard must be I/N"),
        (&["campaign", "small.toml", "--shard", "1/151"], "the campaign has only 150 flights"),
        (
            &["campaign", "small.toml", "--threads", "0"],
            "--threads <N>': the number of threads must be a whole number from 1 on",
        ),
        (
            &["campaign", "small.toml", "--threads", "two"],
            "--threads <N>': the number of threads must be a whole number from 1 on",
        ),
        (
            &["campaign", "small.toml", "--threads", "1.5"],
            "--threads <N>': the number of threads must be a whole number from 1 on",
        ),
        (
            &["campaign", "small.toml", "--threads=-1"],
            "--threads <N>': the number of threads must be a whole number from 1 on",
        ),
        (&["merge", "nowhere", "-o", "merged"], "nowhere: the folder holds no finished results"),
    ] {
        fs::write(folder.join("small.toml"), SMALL).unwrap();
        let output = sitl(&folder, arguments);
        let error = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{error}");
        assert!(error.contains(said), "{said}, not {error}");
        assert!(!folder.join("out").exists());
    }
}

/// Merging needs all parts at once, but the system limits the number of open files.
#[test]
fn more_parts_than_open_files_are_merged() {
    let folder = folder("many-parts");
    fs::write(folder.join("small.toml"), SMALL.replace("= 150", "= 60").replace("= 6.0", "= 0.2")).unwrap();
    succeeds(&sitl(&folder, &["campaign", "small.toml", "--out", "whole"]));
    for index in 1..=60 {
        let (shard, out) = (format!("{index}/60"), format!("part-{index}"));
        succeeds(&sitl(&folder, &["campaign", "small.toml", "--shard", &shard, "--out", &out]));
    }
    let merge = format!("ulimit -n 40; {} merge part-* --out merged", env!("CARGO_BIN_EXE_sitl"));
    let output = Command::new("sh").current_dir(&folder).args(["-c", &merge]).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(results_of(&folder.join("whole")), results_of(&folder.join("merged")));
}

/// Sends a signal before the end of the first flight, and in the middle of a campaign. Neither would end by itself
/// within the test.
#[test]
fn a_signal_stops_it_at_any_time() {
    let folder = folder("signals");
    let text =
        SMALL.replace("flights = 150", "flights = 10000000").replace("= 6.0", "= 36000").replace("0.2, 1.2", "1, 1");
    let text = text.replace("rotor_efficiency = [0.0, 1.0]", "").replace("fault_rotor = [1, 4]", "");
    fs::write(folder.join("long.toml"), text.replace("fault_start_s = [1.0, 5.0]", "")).unwrap();
    for signal in ["-INT", "-TERM"] {
        let out = folder.join(format!("out{signal}"));
        let mut child = command(&folder, &["campaign", "long.toml", "--out"]);
        let child = child.arg(&out).stderr(Stdio::piped()).spawn().unwrap();
        // Signals are handled from here on.
        while !out.join("campaign.json").exists() {
            std::thread::sleep(Duration::from_millis(1));
        }
        assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
        let output = child.wait_with_output().unwrap();
        let error = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(130), "{error}");
        assert!(error.contains("run the same command to resume"), "{error}");
        assert!(!out.join("results.parquet").exists());
    }
}

#[test]
fn no_more_threads_than_useful() {
    let folder = folder("many-threads");
    fs::write(folder.join("few.toml"), SMALL.replace("150", "4").replace("= 6.0", "= 0.2")).unwrap();
    let cores = std::thread::available_parallelism().unwrap().get();
    let output = sitl(&folder, &["campaign", "few.toml", "--threads", "8000", "--out", "many"]);
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{error}");
    assert!(error.contains(&format!("--threads 8000: using only {}, since there are", cores.min(4))), "{error}");
    let output = sitl(&folder, &["campaign", "few.toml", "--threads", "1", "--out", "one"]);
    assert!(!String::from_utf8(output.stderr).unwrap().contains("--threads"));
    assert_eq!(results_of(&folder.join("many")), results_of(&folder.join("one")));
}

/// Errors are evaluated from 5 s on. Shorter flights have null for them, not NaN.
#[test]
fn short_campaigns_hold_no_nan() {
    let folder = folder("short");
    for (flights, duration) in [("3", "0.1"), ("3", "4.999"), ("3", "5.0"), ("1", "5.001"), ("1", "6.0")] {
        let text = SMALL.replace("150", flights).replace("6.0", duration).replace("0.2, 1.2", "0.6, 1.2");
        fs::write(folder.join("short.toml"), &text).unwrap();
        let out = format!("{flights}-of-{duration}");
        let output = sitl(&folder, &["campaign", "short.toml", "--out", &out]);
        let table = String::from_utf8(output.stdout).unwrap();
        assert_eq!(output.status.code(), Some(0));
        assert!(!table.contains("NaN"), "{table}");
        for entry in fs::read_dir(folder.join(&out)).unwrap() {
            let path = entry.unwrap().path();
            let is_text =
                ["html", "json", "svg"].iter().any(|extension| path.extension().is_some_and(|e| e == *extension));
            assert!(!is_text || !fs::read_to_string(&path).unwrap().contains("NaN"), "{}", path.display());
        }
        let campaign = parse(&text);
        for row in (0..campaign.flights).flat_map(|flight| campaign.rows(flight).unwrap()) {
            assert!(row.numbers.iter().flatten().all(|number| number.is_finite()), "{row:?}");
            let jumps = Manifest::new(&campaign, Shard::WHOLE).number(&row, "mean_abs_du4_n");
            assert!(jumps != Some(0.0), "the mean of no jump is none");
        }
    }
}

/// Kills a campaign, resumes it by the same command, and repeats one flight.
#[test]
fn a_killed_program_loses_nothing_that_was_finished() {
    let folder = folder("killed");
    fs::write(folder.join("small.toml"), SMALL.replace("150", "320")).unwrap();
    let whole = sitl(&folder, &["campaign", "small.toml", "--out", "whole", "--threads", "3"]);
    assert_eq!(whole.status.code(), Some(0));

    let out = folder.join("out/small");
    let chunks = || fs::read_dir(out.join("chunks")).map_or(0, |entries| entries.flatten().count());
    loop {
        let mut child = command(&folder, &["campaign", "small.toml", "--threads", "2"]).spawn().unwrap();
        while chunks() < 2 && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        child.kill().unwrap();
        child.wait().unwrap();
        if !out.join("results.parquet").exists() {
            break;
        }
        // On a busy machine, the campaign may end before it is killed.
        fs::remove_dir_all(&out).unwrap();
    }
    let kept = chunks();
    assert!(kept >= 2);

    let again = sitl(&folder, &["campaign", "small.toml"]);
    assert_eq!(again.status.code(), Some(0));
    assert_eq!(again.stdout, String::from_utf8(whole.stdout).unwrap().replace("whole/", "out/small/").into_bytes());
    for file in
        ["results.parquet", "summary.json", "report.html", "position-error.svg", "smoothness.svg", "success.svg"]
    {
        assert_eq!(fs::read(out.join(file)).unwrap(), fs::read(folder.join("whole").join(file)).unwrap(), "{file}");
    }
    assert!(!out.join("chunks").exists());

    let table = String::from_utf8(again.stdout).unwrap();
    let command = table.lines().find_map(|line| line.trim().strip_prefix("sitl ")).unwrap();
    let arguments: Vec<_> = command.split(' ').collect();
    let replay = sitl(&folder, &arguments);
    assert_eq!(replay.status.code(), Some(1), "the worst flight was lost: {command}");
    let flown: Vec<_> = fs::read_dir(folder.join("out")).unwrap().flatten().map(|entry| entry.path()).collect();
    assert!(flown.iter().any(|path| path.join("fig4-trajectory.svg").exists()), "{flown:?}");
}

#[test]
fn built_in_campaigns_are_listed_and_templates() {
    let folder = folder("built-in");
    let list = String::from_utf8(sitl(&folder, &["campaigns"]).stdout).unwrap();
    for built_in in &campaign::BUILT_IN {
        assert!(list.contains(built_in.name), "{list}");
        let printed = sitl(&folder, &["campaigns", built_in.name]);
        assert_eq!(printed.stdout, built_in.text.as_bytes());
        let campaign = built_in.read().unwrap();
        assert_eq!(campaign.name, built_in.name);
        assert!(!campaign.description.is_empty());
        campaign.rows(0).unwrap();
    }
    assert_eq!(built_in("robustness").unwrap().read().unwrap().flights, 10_000);
}

//! Tests campaigns on a cluster: quoting in its shell, log lines and paths.

#![expect(clippy::unwrap_used, reason = "tests")]

use crate::common::{folder, sitl, succeeds};
use std::fs;
use std::process::Output;

/// Short flights, some of which lose the vehicle.
const SHORT: &str = r#"
name = "short"
flights = 40
duration_s = 6.0
scenario = "hover"

[spread]
thrust_factor_ratio = [0.2, 1.2]
rotor_time_constant_s = 0.02
"#;

/// The results do not depend on the folder and name of the campaign's file.
#[test]
fn results_do_not_depend_on_where_the_file_is() {
    let folder = folder("paths");
    fs::create_dir(folder.join("elsewhere")).unwrap();
    let paths = ["short.toml", "./short.toml", "elsewhere/copy of it.toml"];
    for path in paths {
        fs::write(folder.join(path), SHORT).unwrap();
    }
    let absolute = folder.join("short.toml").display().to_string();
    let all: Vec<&str> = paths.into_iter().chain([absolute.as_str()]).collect();
    for (i, path) in all.iter().enumerate() {
        let table = succeeds(&sitl(&folder, &["campaign", path, "--out", &format!("whole-{i}")]));
        // The table in the terminal has a command that works from the current folder.
        let quoted = if path.contains(' ') { format!("\"{path}\"") } else { (*path).to_owned() };
        assert!(table.contains(&format!("sitl campaign {quoted} --flight ")), "{table}");
    }
    for (i, path) in all.iter().take(3).enumerate() {
        let shard = format!("{}/3", i + 1);
        succeeds(&sitl(&folder, &["campaign", path, "--shard", &shard, "--out", &format!("part-{i}")]));
    }
    succeeds(&sitl(&folder, &["merge", "part-0", "part-1", "part-2", "--out", "merged"]));
    for file in ["results.parquet", "report.html", "summary.json", "campaign.json"] {
        let read = |out: &str| fs::read(folder.join(out).join(file)).unwrap();
        for out in ["whole-1", "whole-2", "whole-3", "merged"] {
            assert!(read("whole-0") == read(out), "{out}/{file}");
        }
    }
    let page = fs::read_to_string(folder.join("merged/report.html")).unwrap();
    assert!(page.contains("sitl campaign short.toml --flight "));
}

/// Returns the lines of a log: one at the start, and one for each tenth.
fn lines(output: &Output) -> Vec<String> {
    String::from_utf8(output.stderr.clone()).unwrap().lines().map(str::to_owned).collect()
}

/// True for `RATE per TIME, N UNIT left` with whole numbers and a remaining time above zero.
fn is_rate_and_wait(text: &str) -> bool {
    let parts: Vec<_> = text.split(", ").collect();
    let [rate, wait] = parts.as_slice() else { return false };
    let whole = |number: &str| number.parse::<u64>().is_ok_and(|number| number > 0);
    let rates = [" per second", " per minute", " per hour"];
    let waits = [" s left", " min left", " h left"];
    rates.iter().any(|time| rate.strip_suffix(time).is_some_and(whole))
        && waits.iter().any(|unit| wait.strip_suffix(unit).is_some_and(whole))
}

#[test]
fn a_log_without_a_terminal_shows_life() {
    let folder = folder("log");
    fs::write(folder.join("short.toml"), SHORT).unwrap();
    let flown = sitl(&folder, &["campaign", "short.toml"]);
    let said = lines(&flown);
    succeeds(&flown);
    assert_eq!(said.first().unwrap(), "short: 0 of 40 flights");
    assert_eq!(said.last().unwrap(), "short: 40 of 40 flights");
    let mut before = 0;
    for line in said.iter().take(said.len() - 1).filter(|line| *line != "short: 0 of 40 flights") {
        let (done, rest) = line.strip_prefix("short: ").unwrap().split_once(" of 40 flights, ").unwrap();
        assert!(is_rate_and_wait(rest), "{line}");
        let done: u64 = done.parse().unwrap();
        assert!(done >= before && done <= before + 4, "{said:?}");
        before = done;
    }
    assert!(before >= 36, "{said:?}");

    // Finished flights are not repeated, and there is no progress.
    let again = sitl(&folder, &["campaign", "short.toml"]);
    assert!(lines(&again).iter().all(|line| line == "short: 40 of 40 flights"));
    assert_eq!(flown.stdout, again.stdout);
    // Shards and other commands report progress in the same way.
    let part = sitl(&folder, &["campaign", "short.toml", "--shard", "2/2"]);
    assert_eq!(lines(&part).first().unwrap(), "short: 0 of 20 flights");
    let compared = sitl(&folder, &["compare", "hover", "--seeds", "2", "--controllers", "pid"]);
    assert_eq!(lines(&compared).first().unwrap(), "compare: 0 of 2 flights");
    assert_eq!(lines(&compared).last().unwrap(), "compare: 2 of 2 flights");
}

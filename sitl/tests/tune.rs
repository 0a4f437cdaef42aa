//! `sitl tune`: the search for gains.

#![expect(clippy::unwrap_used, reason = "tests")]

use crate::common::{refused, succeeds};
use crate::compare::{SOFT, sitl, sitl_on, soft};
use afbc_scenario::contender::ControllerKind;
use std::fs;

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

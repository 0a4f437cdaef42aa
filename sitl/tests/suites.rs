//! `sitl compare --suite`: suites of flights, of a file or drawn.

#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

use crate::common::{folder, refused, succeeds};
use crate::compare::{SUITE, json, sitl, sitl_on};
use serde_json::Value;
use std::fs;

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
    assert!(
        table.starts_with("Suite random: seed 2, 2 flights of each vehicle and seed, on the true state"),
        "{table}"
    );
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
    assert!(table.starts_with("Suite rough-estimate: Seed 3; flights of each vehicle, class and seed: 1"), "{table}");
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

//! Tests `sitl plot` on logs that `sitl` writes: CSV, a campaign's Parquet, ULog, MCAP.

#![expect(clippy::unwrap_used, reason = "tests")]

use crate::common::{folder, refused, sitl, succeeds};
use std::fs;
use std::path::Path;

/// Returns the `points` attributes of the lines that are clipped to a panel.
fn lines(svg: &str) -> Vec<String> {
    let document = roxmltree::Document::parse(svg).unwrap();
    let lines = document.descendants().filter(|node| node.tag_name().name() == "polyline");
    let drawn = lines.filter(|line| line.attribute("clip-path").is_some());
    drawn.map(|line| line.attribute("points").unwrap().to_owned()).collect()
}

fn bands(svg: &str) -> usize {
    svg.matches("<polygon").count()
}

fn run(folder: &Path, arguments: &[&str]) -> String {
    succeeds(&sitl(folder, arguments))
}

fn scenario(seed: u64) -> String {
    format!(
        "name = \"hold\"\nduration_s = 6.0\nseed = {seed}\ncontrollers = [\"pid\", \"indi\"]\n[sensors]\nnoise = 0.01\n\
         [trajectory]\nkind = \"hover\"\nposition_m = [0, 0, 1]\n"
    )
}

#[test]
fn flights_are_lines_and_seeds_of_one_law_a_band() {
    let folder = folder("seeds");
    for seed in 1..=5 {
        fs::write(folder.join("hold.toml"), scenario(seed)).unwrap();
        run(&folder, &["fly", "hold.toml", "--out", &format!("{seed}")]);
    }
    let plot = |logs: &[&str], more: &[&str]| {
        run(&folder, &[&["plot"], logs, &["--out", "figure.svg", "--force"], more].concat());
        fs::read_to_string(folder.join("figure.svg")).unwrap()
    };
    let both = plot(&["1/hold-pid.csv", "1/hold-indi.csv"], &["--y", "x_m", "--y", "z_m,z_d_m"]);
    // The two panels have two and four lines, without bands. The names lack their common prefix.
    assert_eq!((lines(&both).len(), bands(&both)), (6, 0));
    assert!(both.contains(">pid</text>") && both.contains(">x [m]</text>") && both.contains(">time [s]</text>"));
    let seeds: Vec<String> = (1..=5).map(|seed| format!("PID={seed}/hold-pid.csv")).collect();
    let seeds: Vec<&str> = seeds.iter().map(String::as_str).collect();
    let band = plot(&seeds, &["--y", "x_m"]);
    assert_eq!((lines(&band).len(), bands(&band)), (1, 1));
    // A path is not a function of x, so every flight is drawn.
    let paths = plot(&seeds, &["--y", "y_m", "--x", "x_m"]);
    assert_eq!((lines(&paths).len(), bands(&paths)), (5, 0));
    // Writes the other formats; existing files are not replaced.
    for file in ["figure.pdf", "figure.png"] {
        let command = ["plot", "1/hold-pid.csv", "--y", "x_m", "--width", "60mm", "--out", file];
        let said = run(&folder, &command);
        assert_eq!(said, format!("{file}: 60.0 mm wide, 1 panels\n"));
        let line = refused(&sitl(&folder, &command));
        assert!(line.starts_with(&format!("{file}: the file exists already; ")), "{line}");
    }
}

#[test]
fn a_campaign_is_drawn_over_what_it_draws() {
    let folder = folder("campaign");
    fs::write(folder.join("hold.toml"), scenario(1)).unwrap();
    let campaign = "flights = 120\nscenario = \"hold.toml\"\n[spread]\nmass_ratio = [0.8, 1.2]\n";
    fs::write(folder.join("few.toml"), campaign).unwrap();
    run(&folder, &["campaign", "few.toml", "--out", "few"]);
    let plot = ["plot", "few/results.parquet", "--y", "rmse_position_m", "--out", "few.svg"];
    run(&folder, &[&plot[..], &["--x", "mass_ratio"]].concat());
    let svg = fs::read_to_string(folder.join("few.svg")).unwrap();
    // Each contender has a median and a band, and a sample of each in the legend.
    assert_eq!((lines(&svg).len(), bands(&svg)), (2, 4));
    assert!(svg.contains(">indi</text>") && svg.contains(">mass ratio</text>"), "{svg}");
    let line = refused(&sitl(&folder, &[&plot[..5], &["other.svg"]].concat()));
    assert!(line.starts_with("few/results.parquet: the log has no time column for rmse_position_m"), "{line}");
}

/// The same flight as ULog and as MCAP gives the same figure.
#[test]
fn ulog_and_mcap_are_drawn_alike() {
    let folder = folder("logs");
    run(&folder, &["fly", "mocap", "--controller", "pid", "--duration", "4", "--ulog", "a.ulg"]);
    run(&folder, &["mcap", "a.ulg"]);
    let draw = |log: &str, out: &str| {
        let panels = ["--y", "vehicle_local_position.x,vehicle_local_position.y", "--y", "vehicle_attitude.q[0]"];
        run(&folder, &[&["plot", log, "--out", out], &panels[..]].concat());
        fs::read_to_string(folder.join(out)).unwrap()
    };
    let (ulog, mcap) = (draw("a.ulg", "a.svg"), draw("a.mcap", "b.svg"));
    assert_eq!(lines(&ulog).len(), 3);
    assert_eq!(ulog, mcap);
    // Topics have different times, so they cannot be drawn over each other.
    let crossed = ["plot", "a.ulg", "--y", "vehicle_local_position.x", "--x", "vehicle_attitude.q[0]"];
    let line = refused(&sitl(&folder, &crossed));
    assert!(
        line.contains("vehicle_attitude.q[0]: its topic has other times than the topic of vehicle_local_position.x"),
        "{line}"
    );
}

#[test]
fn what_cannot_be_drawn_is_refused_in_one_line() {
    let folder = folder("refused");
    fs::write(folder.join("log.csv"), "time_s,x_m\n0,1\n1,2\n").unwrap();
    for (arguments, expected) in [
        (&["log.csv", "--y", "xm"][..], "log.csv: no column xm; did you mean x_m?"),
        (&["nothing.csv", "--y", "x_m"], "nothing.csv: the log cannot be read"),
        (&["log.csv", "--y", "x_m", "--out", "figure.jpg"], "--out figure.jpg: the name's ending selects the format"),
        (&["log.csv", "--y", "x_m", "--from", "5", "--to", "9"], "--out figure.pdf: x [m]: no numbers to draw"),
        (&["log.csv", "--y", "x_m", "--width", "9mm"], "--out figure.pdf: a width of 9 mm leaves no room"),
    ] {
        let line = refused(&sitl(&folder, &[&["plot"], arguments].concat()));
        assert!(line.starts_with(expected) && line.lines().count() == 1, "{line}");
    }
    refused(&sitl(&folder, &["plot", "log.csv", "--y", "x_m", "--width", "88"]));
    refused(&sitl(&folder, &["plot", "--y", "x_m"]));
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
}

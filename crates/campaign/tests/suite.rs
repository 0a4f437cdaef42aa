//! Tests of suite files: keys that a flight copies from another, and mistakes.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs)]

use afbc_campaign::compare::standard_and_monitored;
use afbc_campaign::suite::{Suite, parse};
use afbc_files::read::FileError;
use std::path::Path;

fn suite(text: &str) -> Result<Suite, FileError> {
    parse("mine.toml", text, "mine", Path::new(""))
}

const FIRST: &str = r#"
[[source]]
name = "paper"
citation = "c"
differs = "d"

[[flight]]
name = "first"
description = "the first"
duration_s = 9.0
tilt_max_rad = 1.0
vehicle = { name = "racer" }
trajectory = { kind = "circle", centre_m = [0, 0, 2], radius_m = 2.0, period_s = 5.0 }
rotor_fault = [{ rotor = 1, efficiency = 0.5, start_s = 1.0 }, { rotor = 2, efficiency = 0.5, start_s = 1.0 }]
published = [{ law = "theirs", rms_m = 0.1, source = "paper" }]
"#;

fn second(keys: &str) -> String {
    format!("{FIRST}\n[[flight]]\nname = \"second\"\nlike = \"first\"\n{keys}")
}

#[test]
fn a_flight_takes_over_what_it_does_not_say() {
    let flown = |keys: &str| suite(&second(keys)).unwrap().flights.remove(1);
    let first = suite(FIRST).unwrap().flights.remove(0);
    assert_eq!((first.published[0].rms_m, first.published[0].source, first.scenario.name.as_str()), (0.1, 0, "first"));

    let plain = flown("");
    assert_eq!((plain.scenario.description.as_str(), plain.published.len(), plain.tilt_max_rad), ("", 0, Some(1.0)));
    assert_eq!(plain.scenario.vehicle_file, first.scenario.vehicle_file);
    assert_eq!(plain.scenario.trajectory, first.scenario.trajectory);
    assert_eq!(plain.scenario.realism.rotors.faults, first.scenario.realism.rotors.faults);

    // Tables are merged key by key, lists are replaced as a whole, and a table of another kind is replaced too.
    let wider = flown("duration_s = 8.0\ntrajectory = { radius_m = 3.0 }\nrotor_fault = []");
    let said = FIRST.replace("radius_m = 2.0", "radius_m = 3.0").replace("duration_s = 9.0", "duration_s = 8.0");
    let said = suite(&said).unwrap().flights.remove(0);
    assert_eq!(wider.scenario.trajectory, said.scenario.trajectory);
    assert_eq!((wider.scenario.duration_s, wider.scenario.realism.rotors.faults.len()), (8.0, 0));
    let hover = flown("trajectory = { kind = \"hover\", position_m = [0, 0, 1] }");
    assert_eq!(hover.scenario.trajectory.at(0.0).velocity_m_s.norm(), 0.0);

    // A flight of a named scenario has the suite's description, if there is one, or else the scenario's.
    let named = |words: &str| format!("{FIRST}\n[[flight]]\nname = \"second\"\nscenario = \"hardware\"\n{words}");
    let described = |words: &str| suite(&named(words)).unwrap().flights.remove(1).scenario.description;
    assert_eq!(described("description = \"ours\""), "ours");
    assert!(!described("").is_empty());

    // A flight may copy from a flight that copies itself. The last value wins.
    let third = second("duration_s = 8.0") + "\n[[flight]]\nname = \"third\"\nlike = \"second\"\ntilt_max_rad = 0.9";
    let third = suite(&third).unwrap().flights.remove(2);
    assert_eq!((third.scenario.duration_s, third.tilt_max_rad), (8.0, Some(0.9)));
}

#[test]
fn every_contender_flies_each_flight_with_the_gains_of_its_vehicle() {
    let both = second("") + "\n[[flight]]\nname = \"hardware\"\nscenario = \"hardware\"";
    let contenders = standard_and_monitored();
    let scenarios = suite(&both).unwrap().under(&contenders).unwrap();
    for scenario in &scenarios {
        let names: Vec<_> = scenario.contenders.iter().map(|contender| &contender.name).collect();
        assert_eq!(names, contenders.iter().map(|contender| &contender.name).collect::<Vec<_>>());
    }
    let [first, _, hardware] = scenarios.as_slice() else { unreachable!() };
    for (own, (racer, paper)) in contenders.iter().zip(first.contenders.iter().zip(&hardware.contenders)) {
        assert_eq!(paper, own, "the paper's vehicle has the gains themselves");
        assert!(racer.law != own.law, "{}", own.name);
        assert!(racer.settings.limits.tilt_max_rad >= 1.0);
    }
}

/// Each mistake gives one line with the place of the value, even if the value was copied from another flight.
#[test]
fn mistakes_are_refused_line_by_line() {
    let line = |text: &str| suite(text).unwrap_err().to_string();
    let cases = [
        (String::new(), "flight: missing; add a [[flight]]"),
        (FIRST.replace("name = \"first\"", ""), "flight.name: missing; give the flight a name"),
        (second("").replace("\"second\"", "\"first\""), "flight.name: \"first\" is the name of another flight"),
        (
            second("").replace("like = \"first\"", "like = \"frist\""),
            "flight.like: no flight above is called \"frist\"",
        ),
        (FIRST.replace("duration_s", "like = \"first\"\nduration_s"), "flight.like: no flight above"),
        (FIRST.replace("source = \"paper\"", "source = \"paler\""), "source: \"paler\" is no [[source]]"),
        (FIRST.replace("rms_m = 0.1", "rms_m = -0.1"), "rms_m: -0.1 is out of range"),
        (FIRST.replace("differs = \"d\"", ""), "source.differs: missing"),
        (FIRST.replace("tilt_max_rad = 1.0", "tilt_max_rad = 1.3"), "tilt_max_rad: 1.3 is out of range"),
        (second("controllers = [\"pid\"]"), "controllers: a suite is flown by the contenders of `sitl compare`"),
        (second("trajectory = { radius = 3.0 }"), "radius: unknown key; did you mean radius_m"),
        (second("scenario = \"hardware\""), "unknown key"),
        (FIRST.replace("radius_m = 2.0, ", ""), "radius_m: missing"),
        (format!("{FIRST}\n[[flight]]\nname = \"h\"\nscenario = \"hardwear\""), "did you mean \"hardware\"?"),
        (format!("speed = 1\n{FIRST}"), "speed: unknown key"),
    ];
    for (text, expected) in cases {
        let line = line(&text);
        assert!(
            line.lines().all(|line| line.starts_with("mine.toml")) && line.contains(expected),
            "{line}, not {expected}"
        );
    }
    // The line number is that of the copied value in the other flight.
    let bad = second("").replace("period_s = 5.0", "period_s = 0.0");
    let at = bad.lines().position(|line| line.contains("period_s")).unwrap() + 1;
    assert!(line(&bad).starts_with(&format!("mine.toml:{at}: ")), "{}", line(&bad));
}

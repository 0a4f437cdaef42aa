//! Compares the built-in scenarios with the code, and `docs/reference/scenario-keys.md` with both.

#![expect(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, reason = "tests")]

use super::parse;
use crate::case::Case;
use crate::contender::{Contender, Law};
use crate::paper;
use crate::{BUILT_IN, Scenario, built_in};
use afbc::Profile;
use afbc::adaptive;
use afbc_files::read::FileError;
use afbc_laws::pid;
use afbc_plant::PlantModel;

#[test]
fn built_in_paper_is_the_paper() {
    let from_file = built_in("paper").unwrap().read().unwrap();
    let from_code = Scenario { case: None, ..paper::scenario(PlantModel::Simplified, Case::DEFAULT).unwrap() };
    assert_eq!(from_file, from_code);
}

#[test]
fn built_in_scenarios_are_valid_and_named_after_their_files() {
    for built_in in &BUILT_IN {
        let scenario = built_in.read().unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(scenario.name, built_in.name);
        assert!(!scenario.description.is_empty(), "{}", built_in.name);
    }
}

/// A section of the page: its example, and the key, range and default in each row of its table.
struct Section {
    example: String,
    rows: Vec<[String; 3]>,
}

fn sections() -> Vec<Section> {
    let page = include_str!("../../../../docs/reference/scenario-keys.md");
    let mut sections = Vec::new();
    for part in page.split("```toml\n").skip(1) {
        let (example, text) = part.split_once("```").unwrap();
        let cells = |line: &str| {
            let mut cells = line.split(" | ").map(|cell| cell.trim_matches(['|', ' ']).to_owned());
            [cells.next(), cells.next(), cells.next()].map(Option::unwrap_or_default)
        };
        let rows = text.lines().filter(|line| line.starts_with("| `")).map(cells).collect();
        sections.push(Section { example: example.into(), rows });
    }
    sections
}

/// Parses an example. A trajectory is added if the example has none, and an IMU if it has only other instruments.
fn example(text: &str) -> Result<Scenario, FileError> {
    let hover = "\n[trajectory]\nkind = \"hover\"\nposition_m = [0, 0, 1]\n";
    let added = if text.contains("[trajectory]") { "" } else { hover };
    let alone = text.contains("[instruments.") && !text.contains("[instruments.imu");
    let imu = if alone { "\n[instruments.imu]\n" } else { "" };
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/example.toml");
    parse(file, &format!("{text}{added}{imu}"), "example")
}

/// Replaces the first line of `text` that sets `key`.
fn with_line(text: &str, key: &str, line: &str) -> String {
    let start = format!("{key} = ");
    let old = text.lines().find(|line| line.starts_with(&start)).unwrap_or_else(|| panic!("no {key} in {text}"));
    text.replacen(old, line, 1)
}

#[test]
fn documented_examples_are_valid_and_complete() {
    let sections = sections();
    assert_eq!(sections.len(), 48);
    for Section { example: text, rows } in sections {
        example(&text).unwrap_or_else(|error| panic!("{error} in\n{text}"));
        for line in text.lines().filter(|line| line.contains(" = ")) {
            let documented = rows.iter().any(|[key, ..]| line.starts_with(&format!("{} = ", key.trim_matches('`'))));
            // The table does not list the kind of a trajectory, the profile, and the head of a contender whose gains
            // are the subject.
            let head =
                ["kind", "name", "controller", "profile"].iter().any(|key| line.starts_with(&format!("{key} = ")));
            assert!(documented || head, "{line}");
        }
    }
}

#[test]
fn documented_ranges_are_those_of_the_code() {
    let mut ranges = 0;
    for Section { example: text, rows } in sections() {
        for [key, range, _] in rows {
            let key = key.trim_matches('`');
            if key == "name" || !range.starts_with(|c: char| c.is_ascii_digit() || c == '-') {
                continue;
            }
            // Use the first part of ranges such as "-1.5 to 1.5; yaw -100 to 100" and "0 to 1e9, whole".
            let range = range.split([';', ',']).next().unwrap().trim_end_matches(" each");
            let vector = text.contains(&format!("{key} = ["));
            let value = if vector { "[1e300, 1e300, 1e300]" } else { "1e300" };
            let error = example(&with_line(&text, key, &format!("{key} = {value}"))).unwrap_err().to_string();
            let expected = format!("{key}: 1e300 is out of range: it must lie within {range}");
            let unit = error.split_once(&expected).unwrap_or_else(|| panic!("{expected}, not {error}")).1;
            assert!(unit.is_empty() || unit.starts_with(" ("), "{expected}, not {error}");
            ranges += 1;
        }
    }
    assert!(ranges > 40, "{ranges}");
}

#[test]
fn documented_defaults_are_those_of_the_code() {
    let mut checked = 0;
    for Section { example: text, rows } in sections() {
        for [key, _, default] in rows {
            let key = key.trim_matches('`');
            let without = with_line(&text, key, "");
            if default == "required" {
                let error = example(&without).unwrap_err().to_string();
                assert!(error.contains(&format!("{key}: missing; ")), "{error}");
                checked += 1;
            } else if let Some(value) = default.strip_prefix('`') {
                let with = with_line(&text, key, &format!("{key} = {}", value.trim_end_matches('`')));
                assert_eq!(example(&without).unwrap(), example(&with).unwrap(), "{key}");
                checked += 1;
            }
        }
    }
    assert!(checked > 35, "{checked}");
}

/// A file with any damaged line is either a valid scenario or gives errors that name the file.
#[test]
fn damaged_files_are_told_line_by_line() {
    let values =
        ["", "nan", "-1e300", "1e300", "\"\\n\"", "[]", "{}", "true", "[0, 0]", "1979-05-27", "{ a.b = [[1]] }"];
    let (mut refused, mut accepted) = (0, 0);
    for built_in in &BUILT_IN {
        let lines: Vec<_> = built_in.text.lines().collect();
        for (at, line) in lines.iter().enumerate() {
            let key = line.split_once(" = ").map(|(key, _)| key);
            let mut damaged: Vec<_> = key.map_or(Vec::new(), |key| values.map(|v| format!("{key} = {v}")).to_vec());
            damaged.extend([
                String::new(),
                format!("{line}\n{line}"),
                line.chars().rev().collect(),
                format!("x{line}"),
            ]);
            for damaged in damaged {
                let text = [&lines[..at], &[damaged.as_str()], &lines[at + 1..]].concat().join("\n");
                match parse("damaged", &text, "damaged") {
                    Ok(scenario) => {
                        scenario.check().unwrap();
                        accepted += 1;
                    }
                    Err(error) => {
                        let error = error.to_string();
                        assert!(error.lines().all(|line| line.starts_with("damaged:")), "{error}");
                        refused += 1;
                    }
                }
            }
        }
    }
    assert!(refused > 3000 && accepted > 300, "{refused} refused, {accepted} accepted");
}

#[test]
fn contenders_start_from_the_file_or_from_a_profile() {
    let text = "controllers = [\"afbc\"]\n[gains.z]\ngamma = 5.0\n[settings]\ndt_s = 0.002\nrotor_force_max_n = 4.0\n\
                [[contender]]\nname = \"file\"\ncontroller = \"afbc\"\ngains.z.eta = 0.1\n\
                [[contender]]\nname = \"printed\"\ncontroller = \"afbc\"\nprofile = \"paper\"\nmonitor = true\n\
                [[contender]]\nname = \"pid\"\ncontroller = \"pid\"\ngains.tilt_p_1_s = 9.0\n";
    let contenders = example(text).unwrap().contenders;
    let [short, file, printed, pid] = contenders.as_slice() else { panic!("{contenders:?}") };
    let z = |contender: &Contender| contender.gains().unwrap().z;
    let flight = Profile::Flight.gains().z;
    assert_eq!((short.name.as_str(), z(short)), ("afbc", adaptive::Gains { gamma: 5.0, ..flight }));
    assert_eq!(z(file), adaptive::Gains { gamma: 5.0, eta: 0.1, ..flight });
    assert_eq!((printed.law, printed.monitored), (Law::Afbc(Profile::Paper.gains()), true));
    assert_eq!(printed.settings, Profile::Paper.settings().with_dt_s(0.002));
    let tuned = pid::Gains { tilt_p_1_s: 9.0, ..pid::Gains::TUNED };
    assert_eq!((pid.law, pid.settings), (Law::Pid(tuned), short.settings));
    // Without `controllers`, a file's own contender is the only one.
    assert_eq!(example("[[contender]]\nname = \"a\"\ncontroller = \"indi\"\n").unwrap().contenders.len(), 1);
}

#[test]
fn sensor_faults_and_paces_that_contradict_themselves_are_refused() {
    let refused = |text: &str| example(text).unwrap_err().to_string();
    let fault = |keys: &str| refused(&format!("[[sensor_fault]]\nstart_s = 1\n{keys}"));
    let one = "a sensor fault needs exactly one of factor, offset_m and frozen = true";
    for keys in [
        "axis = \"x\"",
        "axis = \"x\"\nfrozen = false",
        "axis = \"x\"\nfactor = -1\nfrozen = true",
        "axis = \"z\"\nfactor = 2\noffset_m = 1",
    ] {
        assert!(fault(keys).contains(one), "{}", fault(keys));
    }
    assert!(fault("axis = \"yaw\"").contains("factor, offset_rad and"));
    assert!(fault("axis = \"yaw\"\noffset_m = 1").contains("offset_m: unknown key; did you mean offset_rad"));
    assert!(fault("factor = -1").contains("axis: missing; name the axis"));
    let circle = "[trajectory]\nkind = \"circle\"\ncentre_m = [0, 0, 1]\nradius_m = 2\n";
    let both = refused(&format!("{circle}period_s = 3\nacceleration_m_s2 = 4"));
    assert!(both.contains("period_s: period_s and acceleration_m_s2 both set the pace"), "{both}");
    assert!(
        refused(&format!("{}acceleration_m_s2 = 4", circle.replace("= 2", "= 0"))).contains("more than a controller")
    );
}

/// References that no controller accepts are refused. The error names the derivative of position or heading that is too
/// large. A path that lasts longer than any flight is refused, too.
#[test]
fn references_that_no_controller_accepts_are_told() {
    let refused = |keys: &str| example(&format!("[trajectory]\n{keys}")).unwrap_err().to_string();
    let place = |x: f64, yaw: f64| format!("[[trajectory.waypoint]]\nposition_m = [{x}, 0, 1]\nyaw_rad = {yaw}\n");
    let [first, near, far] = [place(0.0, 0.0), place(0.0, 3.0), place(9e3, 0.0)];
    let turns = refused(&format!("kind = \"waypoints\"\n{first}time_s = 1\n{near}time_s = 1.01\n"));
    assert!(turns.contains("waypoint.time_s: it asks for") && turns.contains("rad/s2, more than a"), "{turns}");
    let moves = refused(&format!("kind = \"waypoints\"\n{first}time_s = 1\n{far}time_s = 2\n"));
    assert!(moves.contains("waypoint.time_s: it asks for") && moves.contains("m/s4, more than a"), "{moves}");
    let slow = "kind = \"minimum-snap\"\nspeed_max_m_s = 0.1\nacceleration_max_m_s2 = 1";
    let lasts = refused(&format!("{slow}\n{first}{far}"));
    assert!(
        lasts.contains("speed_max_m_s: the trajectory ends at") && lasts.contains("no flight lasts longer"),
        "{lasts}"
    );
}

/// Circle and lemniscate keep the pace in their keys: the largest acceleration and speed of their references.
#[test]
fn a_circle_has_its_acceleration_and_a_lemniscate_its_speed_and_its_size() {
    let circle = "kind = \"circle\"\nradius_m = 2.5\nacceleration_m_s2 = 14.7";
    let lemniscate = "kind = \"lemniscate\"\nhalf_length_m = 3.5\nspeed_m_s = 6.0";
    let peaks = |keys: &str| {
        let trajectory = example(&format!("[trajectory]\ncentre_m = [1, 2, 3]\n{keys}")).unwrap().trajectory;
        let at = (0..200_000).map(|k| trajectory.at(1e-4 * f64::from(k)));
        at.fold([0.0_f64; 4], |[speed, acceleration, x, y], at| {
            let from = at.position_m - nalgebra::Vector3::new(1.0, 2.0, 3.0);
            assert_eq!(from.z, 0.0);
            [
                speed.max(at.velocity_m_s.norm()),
                acceleration.max(at.acceleration_m_s2.norm()),
                x.max(from.x.abs()),
                y.max(from.y.abs()),
            ]
        })
    };
    let close = |value: f64, expected: f64| assert!((value / expected - 1.0).abs() < 1e-3, "{value}, {expected}");
    let [_, acceleration, radius, _] = peaks(circle);
    close(acceleration, 14.7);
    close(radius, 2.5);
    let [speed, acceleration, x, y] = peaks(lemniscate);
    close(speed, 6.0);
    close(x, 3.5);
    close(y, 1.75);
    close(acceleration, 1.0625 * 36.0 / 3.5);
}

//! Missions in the text format `QGC WPL 110`: read like the same mission in a plan, or refused with the line's number.
#![allow(clippy::indexing_slicing, clippy::unwrap_used, missing_docs, reason = "tests")]

use afbc_serve::{QgcPlan, is_waypoint_file};
use serde_json::{Value, json};

/// An item: frame, command, parameters, place, height, autocontinue.
type Item = (u8, u16, [f64; 4], [f64; 2], f64, bool);

const HOME: ([f64; 2], f64) = ([-33.9, 18.4], 30.0);
const ITEMS: [Item; 6] = [
    (3, 22, [0.0; 4], [-33.9, 18.4], 5.0, true),
    (3, 16, [1.5, 0.0, 0.0, 90.0], [-33.899_99, 18.400_123_4], 8.0, true),
    (2, 178, [1.0, 4.0, -1.0, 0.0], [0.0; 2], 0.0, true),
    (1, 16, [0.0; 4], [12.5, -7.25], -6.0, true),
    (3, 177, [1.0, 2.0, 0.0, 0.0], [0.0; 2], 0.0, true),
    (3, 21, [0.0; 4], [-33.9, 18.4], 0.0, true),
];

fn line(number: usize, (frame, command, [a, b, c, d], [x, y], z, goes_on): Item, between: &str) -> String {
    let numbers = [a, b, c, d, x, y, z].map(|number| number.to_string()).join(between);
    let head = [number, usize::from(number == 0), frame.into(), command.into()].map(|it| it.to_string()).join(between);
    [head, numbers, u8::from(goes_on).to_string()].join(between)
}

/// Returns the mission as text; version 110 begins with the home position.
fn text(version: u16, between: &str, end: &str) -> String {
    let (place, height) = HOME;
    let home = [(0, 16, [0.0; 4], place, height, true)];
    let mut items = ITEMS;
    if version == 110 {
        // Jumps refer to line numbers.
        items[4].2[0] += 1.0;
    }
    let all = home.iter().filter(|_| version == 110).chain(&items);
    let lines = all.enumerate().map(|(number, item)| line(number, *item, between) + end);
    [format!("QGC WPL {version}{end}")].into_iter().chain(lines).collect()
}

/// Returns the same mission as a QGroundControl plan.
fn plan() -> Value {
    let item = |(number, (frame, command, [a, b, c, d], [x, y], z, goes_on)): (usize, Item)| {
        // A plan's jumps refer to `doJumpId`.
        let a = if command == 177 { a + 1.0 } else { a };
        json!({
            "type": "SimpleItem", "autoContinue": goes_on, "doJumpId": number + 1, "command": command, "frame": frame,
            "params": [a, b, c, d, x, y, z],
        })
    };
    let ([latitude, longitude], height) = HOME;
    json!({
        "fileType": "Plan", "version": 1, "groundStation": "QGroundControl",
        "mission": {
            "version": 2, "plannedHomePosition": [latitude, longitude, height],
            "items": ITEMS.into_iter().enumerate().map(item).collect::<Vec<_>>(),
        },
        "geoFence": { "version": 2, "polygons": [], "circles": [] },
        "rallyPoints": { "version": 2, "points": [] },
    })
}

fn read(text: &str) -> Result<QgcPlan, String> {
    QgcPlan::read("my.waypoints", text).map_err(|error| error.to_string())
}

#[test]
fn a_mission_is_read_as_its_plan_is() {
    let expected = read(&plan().to_string()).unwrap();
    for (between, end) in [("\t", "\n"), (" ", "\r\n"), ("\t", "\n\n# a comment\n")] {
        let text = text(110, between, end);
        assert!(is_waypoint_file(text.as_bytes()));
        assert_eq!(read(&text).unwrap(), expected);
        assert_eq!(read(&format!("\u{feff}{text}")).unwrap(), expected);
    }
    // A plan has no home if its file has no home position, or an unknown one (zeros).
    let no_home = QgcPlan { home: None, ..expected };
    assert_eq!(read(&text(120, "\t", "\n")).unwrap(), no_home);
    let unknown = text(110, " ", "\n").replacen(" -33.9 18.4 30 ", " 0 0 0 ", 1);
    assert_eq!(read(&unknown).unwrap(), no_home);
    // In version 110 the first line is an item if it is not a waypoint.
    assert_eq!(read(&text(120, "\t", "\n").replacen("120", "110", 1)).unwrap(), no_home);
}

#[test]
fn what_cannot_be_read_is_refused_by_line() {
    let good = text(110, "\t", "\n");
    for (from, to, said) in [
        ("WPL 110", "WPL 130", ":1: QGC WPL \"130\" is no known version"),
        ("WPL 110", "WPL", ":1: QGC WPL \"\" is no known version"),
        ("\t1\n1\t", "\t1\n2\t", ":3: the line's number is \"2\" instead of 1"),
        ("\t16\t1.5\t", "\t16\tone\t", ":4: param1 is \"one\"; it must be a number"),
        ("\t16\t1.5\t", "\tsixteen\t1.5\t", ":4: command is \"sixteen\""),
        ("\t16\t1.5\t", "\t70000\t1.5\t", ":4: command is \"70000\""),
        ("3\t16\t1.5", "-3\t16\t1.5", ":4: frame is \"-3\""),
        ("18.4001234", "nan", ":4: longitude is \"nan\""),
        ("18.4001234", "inf", ":4: longitude is \"inf\""),
        ("-33.89999", "-133.89999", ":4: latitude -133.89999 or longitude 18.4001234 is out of range"),
        ("18.4001234", "18.4\t18.4", ":4: the line has 13 columns instead of 12"),
        ("\t-6\t1\n", "\t-6\n", ":6: the line has 11 columns instead of 12"),
        ("\t-6\t1\n", "\t-6\t2\n", ":6: the last column (autocontinue) is \"2\"; it must be 1"),
        ("\t-6\t1\n", "\t-6\t0\n", ":6: the last column (autocontinue) must be 1"),
        ("\t177\t2\t", "\t177\t9\t", ": item 4: the jump's target 9 does not exist"),
        ("\t177\t2\t", "\t177\t0\t", ": item 4: the jump's target 0 does not exist"),
        ("\t177\t2\t", "\t177\t1.5\t", ": item 4: the jump's target 1.5 does not exist"),
        ("\t177\t2\t", "\t177\tnan\t", ": item 4: the jump's target NaN does not exist"),
    ] {
        let bad = good.replacen(from, to, 1);
        assert_ne!(bad, good, "{from:?}");
        let error = read(&bad).unwrap_err();
        assert!(error.starts_with(&format!("my.waypoints{said}")) && error.lines().count() == 1, "{to:?}: {error}");
    }
    assert!(!is_waypoint_file(b"name = \"QGC WPL 110\"") && !is_waypoint_file(b""));
}

/// Damaged files never cause a panic.
#[test]
fn no_file_panics() {
    let good = text(110, "\t", "\n").into_bytes();
    let mut seed = 7_u64;
    let mut random = |below: usize| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) as usize % below
    };
    for _ in 0..3000 {
        let mut bytes = good.clone();
        for _ in 0..=random(6) {
            let at = random(bytes.len().max(1));
            if bytes.is_empty() {
                break;
            }
            match random(3) {
                0 => bytes[at] = b"\t\n 0123456789.-+enaif#"[random(22)],
                1 => drop(bytes.remove(at)),
                _ => bytes.truncate(at.max(1)),
            }
        }
        if let Ok(text) = String::from_utf8(bytes) {
            let _ = read(&text);
        }
    }
}

//! Every mistake in a file is reported with its line and key, and nothing else is.

#![expect(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, reason = "tests")]

use afbc_files::read::FileError;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Reads a text as one kind of file and returns the error, if any.
type Read = fn(&str) -> Option<FileError>;

fn scenario(text: &str) -> Option<FileError> {
    afbc_scenario::parse("my.toml", text, "my").err()
}

fn campaign(text: &str) -> Option<FileError> {
    afbc_campaign::parse("my.toml", text, "my", Path::new("")).err()
}

fn vehicle(text: &str) -> Option<FileError> {
    afbc_scenario::vehicle_of("my.toml", text, "my").err()
}

/// Returns every built-in file with its reader.
fn files() -> Vec<(&'static str, Read)> {
    let scenarios = afbc_scenario::BUILT_IN.iter().map(|known| (known.text, scenario as Read));
    let campaigns = afbc_campaign::BUILT_IN.iter().map(|known| (known.text, campaign as Read));
    let vehicles = afbc_vehicles::BUILT_IN.iter().map(|known| (known.text, vehicle as Read));
    scenarios.chain(campaigns).chain(vehicles).collect()
}

/// Returns the key of a line `key = value`, unless the value continues on the next line.
fn key(line: &str) -> Option<&str> {
    let (key, value) = line.split_once(" = ")?;
    let is_plain = key.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_');
    let value = value.split('#').next()?.trim();
    let is_whole = value.matches('[').count() == value.matches(']').count();
    (is_plain && is_whole).then_some(key)
}

/// A mistake made in a line of a file.
#[derive(Clone, Copy, Debug)]
enum Slip {
    /// A value of another type.
    Type,
    /// A number beyond every range. For other values, a value of another type.
    Size,
    /// An additional line with an unknown key.
    Key,
}

impl Slip {
    const ALL: [Slip; 3] = [Slip::Type, Slip::Size, Slip::Key];

    fn line(self, line: &str, key: &str) -> String {
        let value = line.split_once(" = ").unwrap().1.split('#').next().unwrap().trim();
        let wrong = if value == "true" || value == "false" { "7" } else { "true" };
        match self {
            Slip::Size if value.parse::<f64>().is_ok() => format!("{key} = 1e300"),
            Slip::Type | Slip::Size => format!("{key} = {wrong}"),
            Slip::Key => format!("{line}\nqqq_{key} = 1"),
        }
    }
}

/// Pseudo-random numbers.
struct Lot(u64);

impl Lot {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % end
    }
}

/// Makes the mistakes `slips` in these lines of a file, and checks that each is reported once and nothing else is.
fn check(read: Read, lines: &[&str], slips: &BTreeMap<usize, Slip>) {
    let (mut made, mut expected) = (String::new(), BTreeSet::new());
    for (place, line) in lines.iter().enumerate() {
        let line = match (slips.get(&place), key(line)) {
            (Some(slip), Some(key)) => {
                let wrong = slip.line(line, key);
                let at = made.lines().count() + wrong.lines().count();
                expected.insert((at, wrong.lines().last().unwrap().split(' ').next().unwrap().to_owned()));
                wrong
            }
            _ => (*line).to_owned(),
        };
        made += &(line + "\n");
    }
    let told = read(&made).unwrap_or_else(|| panic!("nothing is wrong in\n{made}")).to_string();
    let place = |line: &str| {
        let mut parts = line.strip_prefix("my.toml:").unwrap_or_else(|| panic!("{line}\nof\n{made}")).split(": ");
        let at: usize = parts.next().unwrap().parse().unwrap();
        (at, parts.next().unwrap().rsplit('.').next().unwrap().to_owned())
    };
    let places: Vec<_> = told.lines().map(place).collect();
    assert_eq!(places.iter().cloned().collect::<BTreeSet<_>>(), expected, "{slips:?}: {told}\nin\n{made}");
    assert_eq!(places.len(), expected.len(), "{told}");
}

fn places(lines: &[&str]) -> Vec<usize> {
    (0..lines.len()).filter(|place| key(lines[*place]).is_some()).collect()
}

#[test]
fn every_mistake_is_told_by_itself() {
    for (text, read) in files() {
        assert_eq!(read(text).map(|error| error.to_string()), None);
        let lines: Vec<&str> = text.lines().collect();
        for place in places(&lines) {
            for slip in Slip::ALL {
                check(read, &lines, &BTreeMap::from([(place, slip)]));
            }
        }
    }
}

/// A missing key gives one error at most, whatever depends on the key.
#[test]
fn a_line_less_is_told_once() {
    // Campaign files are left out: without a key, each quantity that then has no effect is an error of its own.
    let is_campaign = |text: &str| afbc_campaign::BUILT_IN.iter().any(|known| known.text == text);
    for (text, read) in files().into_iter().filter(|(text, _)| !is_campaign(text)) {
        let lines: Vec<&str> = text.lines().collect();
        for place in places(&lines) {
            let mut made = lines.clone();
            let line = made.remove(place);
            let told = read(&made.join("\n")).map_or(String::new(), |error| error.to_string());
            assert!(told.lines().count() <= 1, "without {line}: {told}\nin\n{}", made.join("\n"));
        }
    }
}

#[test]
fn every_mistake_is_told_beside_others() {
    let mut lot = Lot(24);
    for (text, read) in files() {
        let lines: Vec<&str> = text.lines().collect();
        let places = places(&lines);
        for count in [2; 30].into_iter().chain([3, 5, 8, 3, 5, 8]) {
            let slip = |lot: &mut Lot| (places[lot.below(places.len())], Slip::ALL[lot.below(3)]);
            check(read, &lines, &(0..count).map(|_| slip(&mut lot)).collect());
        }
    }
}

/// A misspelt key is read as the similar known key, so that its value is not reported as missing.
#[test]
fn what_follows_from_a_mistake_is_none() {
    for (text, expected) in [
        (
            "durration_s = 5\n[trajectory]\nkind = \"circel\"\nradius = 3\n[sensors]\nnois = \"a\"\n",
            &[":1: durration_s: unknown key", ":3: trajectory.kind: \"circel\" is unknown; did you mean"][..],
        ),
        (
            "[trajectory]\nkind = \"waypoints\"\n[[trajectory.waypoint]]\ntime_s = -1\nposition_m = [0, 0, 1]\n\
             [[trajectory.waypoint]]\ntime_s = 3\nposition_m = [0, 1]\n[[trajectory.waypoint]]\ntime = 4\n\
             position_m = [0, 0, 2]\n",
            &[":4: trajectory.waypoint.time_s", ":8: trajectory.waypoint.position_m", ":10: trajectory.waypoint.time"],
        ),
        (
            "[vehicle]\nname = \"racr\"\n[truth]\nmass = 1\n[trajectory]\nkind = \"paper\"\n",
            &[":2: vehicle.name", ":4: truth.mass"],
        ),
        ("[trajectory]\nkind = \"paper\"\nx = \n[drag\ny = 3\n", &[":3: syntax", ":4: syntax"]),
    ] {
        let told = scenario(text).unwrap().to_string();
        for line in expected {
            assert!(told.contains(line), "{line} is not in\n{told}");
        }
    }
    let text =
        "[trajectory]\nkind = \"hover\"\nposition_m = [0, 0, 1]\n[vehicle]\nname = \"./none.toml\"\n[gust]\nx = 1\n";
    let told = scenario(text).unwrap().to_string();
    assert!(told.contains("none.toml: no such file") && told.contains(":6: gust"), "{told}");
}
